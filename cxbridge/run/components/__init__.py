"""The components of runs and daemons, each in a file; :mod:`table` lists them."""
