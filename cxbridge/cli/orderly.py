"""Commands that a signal ends in order, from their first line to their last."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import ParamSpec, TypeVar

from cxbridge.cli.entry import plain_interrupt

_P = ParamSpec("_P")
_T = TypeVar("_T")


def orderly(*, service: bool = False) -> Callable[[Callable[_P, _T]], Callable[_P, _T]]:
    """Let a command note SIGINT, SIGTERM and SIGHUP from before its imports until it has cleaned up.

    What it starts takes them over; see :class:`cxbridge.process.interrupt.Interrupt`.

    :param service: it serves others until a signal stops it.
    """

    def decorate(command: Callable[_P, _T]) -> Callable[_P, _T]:
        @functools.wraps(command)
        def run(*args: _P.args, **kwargs: _P.kwargs) -> _T:
            with plain_interrupt():
                from cxbridge.process.interrupt import Interrupt

                with Interrupt(service=service):
                    return command(*args, **kwargs)

        return run

    return decorate
