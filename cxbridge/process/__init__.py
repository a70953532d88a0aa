"""How a process of cxbridge lives: signals, systemd, limits, blackboards by URL."""
