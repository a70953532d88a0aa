"""Exploration of agents with seeded defects."""
