"""Sweeps: thousands of runs of a scenario in drawn worlds, with statistics of one agent or two."""
