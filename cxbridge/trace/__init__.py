"""Recorded runs: events to files and back, and the comparison of two runs.

docs/formats.md describes the events and the files.
"""
