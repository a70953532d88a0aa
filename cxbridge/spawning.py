"""The command of Python child processes."""

from __future__ import annotations

import sys


def python_command(*arguments: str) -> list[str]:
    """Return the command of a Python process without the working directory on its path (-P).

    The files of the working directory may be untrusted.
    """
    return [sys.executable, "-P", *arguments]
