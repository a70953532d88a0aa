"""Tests of the simulated navigation."""
