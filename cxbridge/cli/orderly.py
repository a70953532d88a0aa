"""Commands that a signal ends in order, from their first line to their last."""

from __future__ import annotations

import functools
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, ParamSpec, TypeVar

from cxbridge.cli.entry import plain_interrupt
from cxbridge.errors import BrokenAgentError

_P = ParamSpec("_P")
_T = TypeVar("_T")


def orderly(*, service: bool = False) -> Callable[[Callable[_P, _T]], Callable[_P, _T]]:
    """Let a command note SIGINT, SIGTERM and SIGHUP from before its imports until it has cleaned up.

    Its child processes take the signals over; see :class:`cxbridge.process.interrupt.Interrupt`.

    :param service: whether it serves clients until a signal stops it.
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


if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions


@contextmanager
def in_words_of_check(options: RunOptions) -> Iterator[None]:
    """Add the findings of explainers to a :class:`BrokenAgentError`: the wrong word, the likely right one.

    :param options: of the run.
    :raises BrokenAgentError: when one was raised.
    """
    try:
        yield
    except BrokenAgentError as error:
        from cxbridge.run.explainers import with_explanations

        raise with_explanations(error, options) from None
