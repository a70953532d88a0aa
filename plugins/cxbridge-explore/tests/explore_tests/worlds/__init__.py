"""Tests of the worlds of runs."""
