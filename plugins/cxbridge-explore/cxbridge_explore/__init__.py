"""Exploration: plays a scenario in every way that its world allows, by forking the run at choice points."""
