"""Tests of the skill board."""
