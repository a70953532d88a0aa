"""Validation of plans: execution of their steps in the semantics of PDDL."""
