"""The terminal view of a daemon or a recorded run; see docs/see.md#the-monitor."""
