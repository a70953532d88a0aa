"""The command line, one file per command or group. Commands import their modules when they run."""
