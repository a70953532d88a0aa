"""Rates of writes to interfaces, and graphs of skills."""
