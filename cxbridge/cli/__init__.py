"""The command line. Each command or group has a module in :mod:`.commands`, imported on first use."""
