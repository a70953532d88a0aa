"""``cxbridge run --replay``: an executive in the environment that it had; docs/replay.md."""
