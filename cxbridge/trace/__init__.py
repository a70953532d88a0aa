"""Recorded runs: events in files, and the comparison of runs.

docs/formats.md describes the events and the files.
"""
