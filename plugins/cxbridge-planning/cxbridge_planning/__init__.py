"""Additional planners (unified-planning engines and external programs) and the command ``plan``."""
