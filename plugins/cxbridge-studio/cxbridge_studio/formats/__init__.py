"""Formats of recordings that only tools for authors read."""
