"""Why a rule has not fired, how a goal came to its outcome, which parts of an agent a set of runs has used.

docs/explain.md lists the reports, and how the reasons are found.
"""
