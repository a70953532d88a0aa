"""The terminal's view of a daemon or of a recorded run; see docs/monitor.md."""
