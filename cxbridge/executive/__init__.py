"""CLIPS environments as in Fawkes, features for them, and the CLIPS Executive."""
