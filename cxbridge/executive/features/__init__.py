"""The features that environments can request: config, blackboard, redefine-warning, pddl-parser."""
