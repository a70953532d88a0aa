"""The entry point of the program, which prepares the handling of signals first."""

from __future__ import annotations

import gc
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

# Objects made before Python looks for garbage: at its own 700 it looks 80 times while modules are loaded.
_GARBAGE_THRESHOLD: Final = 10_000


@contextmanager
def plain_interrupt() -> Iterator[None]:
    """Let Ctrl-C end the process immediately, as in C programs.

    During imports, a KeyboardInterrupt would at best be a traceback. At worst it is raised where Python drops
    exceptions, and the signal has no effect.
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
    """Run the command line and exit with the command's status."""
    gc.set_threshold(_GARBAGE_THRESHOLD, *gc.get_threshold()[1:])
    with plain_interrupt():
        from cxbridge.cli.main import main as run
    try:
        run()
    finally:
        gc.freeze()  # the objects are freed with the process, so a final collection is useless
        if signal.getsignal(signal.SIGINT) is signal.default_int_handler:
            signal.signal(signal.SIGINT, signal.SIG_DFL)  # nothing is left to clean up
