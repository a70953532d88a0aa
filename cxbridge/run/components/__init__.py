"""The components of runs and daemons. :mod:`table` lists them."""
