"""A running Fawkes: its network protocol, the gateway, remote Skillers, files of bblogger and ffbblog."""
