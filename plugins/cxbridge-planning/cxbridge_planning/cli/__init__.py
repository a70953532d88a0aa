"""The command ``plan``, and the page about a plan: a timeline, the states, why each step is there."""
