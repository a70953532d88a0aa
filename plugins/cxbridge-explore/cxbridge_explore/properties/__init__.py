"""Properties that must hold in each run of an agent, and the monitors that check properties."""
