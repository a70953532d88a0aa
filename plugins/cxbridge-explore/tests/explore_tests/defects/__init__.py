"""Defects that are seeded in copies of the shipped agents, to be found by exploring."""
