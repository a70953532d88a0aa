"""Tests of the worlds that runs can meet."""
