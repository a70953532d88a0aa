"""Planner processes, and the calls that use them."""
