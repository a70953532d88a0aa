"""Thousands of runs of a scenario in drawn worlds, and their statistics about one agent, or about two."""
