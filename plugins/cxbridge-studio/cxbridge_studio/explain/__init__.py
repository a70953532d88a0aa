"""Explanations of runs: why a rule has not fired, how a goal came to its outcome, the coverage of runs.

docs/check.md#why describes the reports and how the reasons are found.
"""
