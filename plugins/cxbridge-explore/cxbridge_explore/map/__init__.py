"""The map of an exploration: the branches and ends of its runs, and the coverage of the agent."""
