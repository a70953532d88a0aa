"""Comparison of recorded runs; docs/trace-model.md defines when two runs are the same."""
