"""Clients of a Skiller: calls and graphs of skills."""
