"""Reasons why a run does not start or ends early: a broken agent, a stuck run."""
