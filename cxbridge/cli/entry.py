"""The entry point of the program, and the signals that end a command.

Signals are handled from the first import on: a KeyboardInterrupt within an import would print a traceback, or
would get lost where Python ignores exceptions.
"""

from __future__ import annotations

import functools
import gc
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, ParamSpec, TypeVar

# The number of new objects that starts a garbage collection: with 700, the default of Python 3.11, the
# imports and a short run cause 80 useless collections, which take a tenth of their time.
_GARBAGE_THRESHOLD: Final = 50_000

_P = ParamSpec("_P")
_T = TypeVar("_T")


@contextmanager
def default_interrupt() -> Iterator[None]:
    """Let Ctrl-C end the process within the block without a traceback, as the system does by default."""
    handler = signal.getsignal(signal.SIGINT)
    # a program that calls the command line keeps its own handler; Python sets handlers in the main thread
    # only
    is_replaced = (
        handler is signal.default_int_handler and threading.current_thread() is threading.main_thread()
    )
    if is_replaced:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        if is_replaced:
            signal.signal(signal.SIGINT, handler)


def handle_signals(*, is_service: bool = False) -> Callable[[Callable[_P, _T]], Callable[_P, _T]]:
    """Return a decorator for commands that handle SIGINT, SIGTERM and SIGHUP, from before their imports on.

    Instances of :class:`cxbridge.interrupt.Interrupt` within the command take over the signals.

    :param is_service: whether the command serves clients until a signal stops it.
    """

    def decorate(command: Callable[_P, _T]) -> Callable[_P, _T]:
        @functools.wraps(command)
        def run(*args: _P.args, **kwargs: _P.kwargs) -> _T:
            with default_interrupt():
                from cxbridge.interrupt import Interrupt

                with Interrupt(is_service=is_service):
                    return command(*args, **kwargs)

        return run

    return decorate


def main() -> None:
    """Run the command line and exit with the command's status."""
    gc.set_threshold(_GARBAGE_THRESHOLD, *gc.get_threshold()[1:])
    with default_interrupt():
        from cxbridge.cli.main import main as run
    gc.freeze()  # a collection in a short run would examine all imported modules
    try:
        run()
    finally:
        gc.freeze()  # the objects are freed with the process, so a final collection is useless
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            # nothing is left to clean up, so Ctrl-C may end the process at once
            signal.signal(signal.SIGINT, signal.SIG_DFL)
