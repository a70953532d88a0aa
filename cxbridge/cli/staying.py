"""Servers that run after the end of a run until the user ends them."""

from __future__ import annotations

import select
import sys
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from cxbridge.cli.console import say

if TYPE_CHECKING:
    from cxbridge.run.result import RunResult
    from cxbridge.run.servers import RunServer, Stay


def has_pressed_enter() -> bool:
    """Return whether a user at the terminal has pressed Enter."""
    if not sys.stdin.isatty():
        return False
    ready, _, _ = select.select([sys.stdin], [], [], 0)
    return bool(ready) and sys.stdin.readline() is not None


def stay_after(show: Callable[[RunResult], None]) -> Stay:
    """Return a function that shows the result of a run and how the user ends its servers."""

    def stay(result: RunResult, servers: Sequence[RunServer]) -> Callable[[], bool]:
        show(result)
        names = " and ".join(server.stays for server in servers if server.stays)
        end = "Enter or Ctrl-C" if sys.stdin.isatty() else "Ctrl-C"
        say(f"Serving {names} until {end}", err=True, flush=True)
        return has_pressed_enter

    return stay
