"""Exploration: every way that a run can go, up to a number of faults, by forking it at its choice points."""
