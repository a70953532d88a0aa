"""A running Fawkes: its network protocol, the gateway, Skillers elsewhere, files of bblogger and ffbblog."""
