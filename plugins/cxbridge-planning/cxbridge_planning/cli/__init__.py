"""The command ``plan``, and the page about a plan: a timeline, the states, the reason of each step."""
