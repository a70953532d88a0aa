"""The map of an exploration: where its runs branch and end, and what they have used of the agent."""
