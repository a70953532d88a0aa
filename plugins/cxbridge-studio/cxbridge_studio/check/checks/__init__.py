"""The checks of the studio. Each module has ``CODES`` and ``check(agent)``: a row of the table of checks."""
