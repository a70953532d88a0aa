"""Properties that must hold in every run of an agent, and the monitors that check them."""
