"""The planners: the embedded one, programs on the PATH, and those of unified-planning."""
