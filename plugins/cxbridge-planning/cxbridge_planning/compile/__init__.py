"""Compilation to STRIPS: bind variables and remove features that simple planners lack."""
