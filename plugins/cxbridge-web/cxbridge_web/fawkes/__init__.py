"""Fawkes' REST API: the same paths, models and texts; docs/rest.md lists what differs."""
