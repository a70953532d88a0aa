"""The built-in properties, which each run of each agent should have."""
