"""Tests of properties and their monitors."""
