"""The commands ``explore``, ``sweep`` and ``game``."""
