"""Simulated skills: durations and outcomes by estimators, and injected faults."""
