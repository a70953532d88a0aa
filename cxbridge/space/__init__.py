"""Coordinate frames over time, and navigation graphs."""
