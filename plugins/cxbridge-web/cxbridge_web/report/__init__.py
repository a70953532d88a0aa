"""A run as one page: ``cxbridge trace report``; what such pages show is in docs/see.md."""
