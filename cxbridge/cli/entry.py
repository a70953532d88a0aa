"""The entry point of the program: little happens before signals do what users expect."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

_GARBAGE_THRESHOLD: Final = 10_000
"""Objects made before Python looks for garbage: at its own 700 it looks 80 times while modules are loaded."""


@contextmanager
def plain_interrupt() -> Iterator[None]:
    """Let Ctrl-C end the process at once, as it ends a program in C.

    While modules are loaded a KeyboardInterrupt would be a traceback at best. At worst it is raised where
    Python drops exceptions, and the signal has no effect.
    """
    before = signal.getsignal(signal.SIGINT)
    ours = before is signal.default_int_handler and threading.current_thread() is threading.main_thread()
    if ours:
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    try:
        yield
    finally:
        if ours:
            signal.signal(signal.SIGINT, before)


def main() -> None:
    """Run the command line; exits with the command's status."""
    gc.set_threshold(_GARBAGE_THRESHOLD, *gc.get_threshold()[1:])
    with plain_interrupt():
        from cxbridge.cli.main import main as run
    try:
        run()
    finally:
        gc.freeze()  # the rest goes with the process: no collection looks through it
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # there is nothing left to do
