"""Sweeps: thousands of runs of a scenario, each in a world drawn from a seed, with statistics."""
