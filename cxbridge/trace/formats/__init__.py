"""Formats of recorded runs, one module or package each; :mod:`.registry` finds them."""
