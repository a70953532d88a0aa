"""Thousands of runs of a scenario in drawn worlds, and what they say about an agent, or about two."""
