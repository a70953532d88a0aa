"""Comparison of recorded runs; docs/comparing.md defines when two runs are the same."""
