"""The planners: pyperplan, programs, and engines of unified-planning."""
