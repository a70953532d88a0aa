"""Whether a plan holds: its steps done one after the other, in the semantics of PDDL."""
