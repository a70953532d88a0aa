"""Games: runs in which a referee awards points."""
