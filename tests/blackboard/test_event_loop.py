"""Threads with event loops, closed during their start and during work."""

from __future__ import annotations

import asyncio
import gc
import re
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress

import pytest

from cxbridge.blackboard.kit.event_loop import LoopThread
from tests.support import module_files

LOOPS = re.compile(r"new_event_loop|asyncio\.run\(|Runner\(|run_until_complete|run_forever")


def make_thread() -> LoopThread:
    return LoopThread("tested")


@contextmanager
def complaints() -> Iterator[list[str]]:
    """Collect errors of threads, and warnings about open loops and sockets."""
    found: list[str] = []
    gc.collect()
    hooks = threading.excepthook, sys.unraisablehook
    threading.excepthook = lambda args: found.append(repr(args))
    sys.unraisablehook = lambda args: found.append(repr(args))
    try:
        with warnings.catch_warnings(record=True) as warned:
            warnings.simplefilter("always")
            yield found
            gc.collect()
        found += [
            str(warning.message)
            for warning in warned
            if warning.category in (ResourceWarning, RuntimeWarning)
        ]
    finally:
        threading.excepthook, sys.unraisablehook = hooks


def test_single_module_makes_event_loops():
    """Other code with event loops had errors at their end, such as open sockets."""
    files = module_files().values()
    makers = {path.name for path in files if LOOPS.search(path.read_text("utf-8"))}
    assert makers == {"event_loop.py"}


def close_a_thread() -> None:
    make_thread().close()


def close_a_thread_that_has_work() -> None:
    with make_thread() as thread:
        thread.spawn(asyncio.Event().wait())


@pytest.mark.parametrize("close", [close_a_thread, close_a_thread_that_has_work])
def test_close_after_start_ends_thread_without_complaints(close: Callable[[], None]):
    threads = threading.active_count()
    with complaints() as found:
        for _ in range(20):
            close()
    assert found == []
    assert threading.active_count() <= threads


def test_close_before_thread_runs_ends_thread(monkeypatch: pytest.MonkeyPatch):
    """A machine under load starts the thread late, and the close waits in the loop's queue."""
    run, late = threading.Thread.run, threading.Event()

    def run_late(self: threading.Thread) -> None:
        late.wait(20)
        run(self)

    monkeypatch.setattr(threading.Thread, "run", run_late)
    with complaints() as found:
        thread = make_thread()
        monkeypatch.undo()
        work = thread.spawn(asyncio.Event().wait())
        closing = threading.Thread(target=thread.close)
        closing.start()
        late.set()
        closing.join(20)
        with suppress(CancelledError):
            work.result(20)
    assert found == []
    assert work.cancelled()
    assert not closing.is_alive()


def test_closed_thread_refuses_calls_and_coroutines():
    with complaints() as found:
        thread = make_thread()
        thread.close()
        assert not thread.call(print)
        with pytest.raises(RuntimeError, match="closed"):
            thread.spawn(asyncio.Event().wait())
    assert found == []
