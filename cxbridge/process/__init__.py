"""The process of cxbridge: signals, systemd, limits."""
