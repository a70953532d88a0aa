"""Recorded runs: events to files and back, and the comparison of two runs.

docs/trace-model.md describes the model, docs/formats.md the files.
"""
