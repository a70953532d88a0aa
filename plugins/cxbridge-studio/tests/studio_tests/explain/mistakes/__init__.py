"""Agents with one typical mistake each, and what `why` has to say about them."""
