"""The feature ``robot_memory``: functions for rules."""
