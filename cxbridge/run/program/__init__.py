"""Runs started by Python programs, the API of ``import cxbridge as cx``."""
