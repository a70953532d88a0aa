"""Games: runs that a referee judges by points."""
