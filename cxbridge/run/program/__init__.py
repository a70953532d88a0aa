"""Runs that a Python program makes: what ``import cxbridge as cx`` gives for them."""
