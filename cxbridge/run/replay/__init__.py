"""``cxbridge run --replay``: an executive in a recorded environment, see docs/recording.md."""
