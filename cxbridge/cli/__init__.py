"""The command line: one file a group of commands. A command imports its modules when it runs."""
