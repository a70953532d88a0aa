"""Our CLIPS environment held against a real CLIPS 6.30, Debian's package ``clips``."""
