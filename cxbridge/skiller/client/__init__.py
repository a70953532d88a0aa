"""Clients of a Skiller: calls of skills, and their graphs."""
