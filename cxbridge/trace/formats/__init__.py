"""One module or package for each format of recorded runs; :mod:`.registry` finds them."""
