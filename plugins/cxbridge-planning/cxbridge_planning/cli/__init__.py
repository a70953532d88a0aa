"""The command ``plan`` and the page about a plan: timeline, states, and the purpose of each step."""
