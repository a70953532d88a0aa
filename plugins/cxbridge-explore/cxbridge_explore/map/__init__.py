"""The map of an exploration: branches and ends of its runs, and the coverage of the agent."""
