"""The node ``pddl_manager`` of the executive's PDDL extension, with problems that peers change."""
