"""The life of a process of cxbridge: signals, systemd, limits."""
