"""Common parts of transports. docs/architecture.md shows how to add a transport."""
