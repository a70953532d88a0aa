"""Worlds of runs: choice points, choosers, and a run in a chosen world."""
