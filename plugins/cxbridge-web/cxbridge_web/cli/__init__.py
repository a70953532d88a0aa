"""The commands of the page, and the options of commands that serve it."""
