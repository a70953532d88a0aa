"""Facts of an environment: made, copied, edited and modified."""
