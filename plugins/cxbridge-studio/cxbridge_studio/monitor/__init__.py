"""``cxbridge monitor``: shows a daemon or a recorded run in the terminal; see docs/see.md#the-monitor."""
