"""Comparison of recorded runs; docs/comparing.md defines equality."""
