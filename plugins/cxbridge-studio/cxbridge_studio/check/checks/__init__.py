"""Check modules. Each has ``CODES`` and ``check(agent)`` and is a row of the table of checks."""
