"""The feature ``planner``: plans for rules."""
