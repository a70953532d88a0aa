"""The properties that every run of every agent should have."""
