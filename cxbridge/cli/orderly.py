"""Commands that signals end in order."""

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
    """Make a command handle SIGINT, SIGTERM and SIGHUP from before its imports until its end.

    Its child processes take over the handling, see :class:`cxbridge.interrupt.Interrupt`.

    :param service: whether the command serves clients until a signal stops it.
    """

    def decorate(command: Callable[_P, _T]) -> Callable[_P, _T]:
        @functools.wraps(command)
        def run(*args: _P.args, **kwargs: _P.kwargs) -> _T:
            with plain_interrupt():
                from cxbridge.interrupt import Interrupt

                with Interrupt(service=service):
                    return command(*args, **kwargs)

        return run

    return decorate


if TYPE_CHECKING:
    from cxbridge.run.options import RunOptions


@contextmanager
def in_words_of_check(options: RunOptions) -> Iterator[None]:
    """Add the findings of explainers, the wrong and the likely right word, to a :class:`BrokenAgentError`.

    :raises BrokenAgentError: if one was raised.
    """
    try:
        yield
    except BrokenAgentError as error:
        from cxbridge.run.explainers import with_explanations

        raise with_explanations(error, options) from None
