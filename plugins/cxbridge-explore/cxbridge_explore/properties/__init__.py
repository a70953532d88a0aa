"""Properties: what must hold in every run of an agent, and the monitors that watch over it."""
