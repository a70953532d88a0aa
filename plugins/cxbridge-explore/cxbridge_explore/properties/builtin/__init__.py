"""The built-in properties, for every run of every agent."""
