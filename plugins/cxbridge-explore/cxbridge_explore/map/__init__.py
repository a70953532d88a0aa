"""The map of an exploration: the branches and ends of its runs, and the used parts of the agent."""
