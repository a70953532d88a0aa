"""Agents with a typical mistake, and the explanations of `why`."""
