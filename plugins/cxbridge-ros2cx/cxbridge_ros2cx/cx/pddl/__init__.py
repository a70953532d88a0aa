"""The node ``pddl_manager`` of the executive's extension for PDDL: problems that peers change."""
