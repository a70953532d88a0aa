"""Commands for the terminal: rates and plots of interfaces, the graph of a skill, the states of a Skiller."""
