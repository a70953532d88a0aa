"""The servers of a daemon as components, each in a file."""
