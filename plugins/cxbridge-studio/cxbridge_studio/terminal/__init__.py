"""Drawings in the terminal: rates and plots of interfaces, graphs of skills, the states of a Skiller."""
