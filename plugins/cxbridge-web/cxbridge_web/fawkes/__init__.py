"""Fawkes' REST API with the same paths, models and texts; docs/rest.md lists the differences."""
