"""Why a rule has not fired, how a goal came to its outcome, what a set of runs has used of an agent.

docs/explain.md says what is reported, and how it is found.
"""
