"""Features that environments can request."""
