"""A thread with an event loop may be closed at any moment: while it starts, while it serves, twice."""

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


def made() -> LoopThread:
    return LoopThread("tested")


@contextmanager
def complaints() -> Iterator[list[str]]:
    """Collect what Python says of errors in threads, of loops and of sockets that are left open."""
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
        found += [str(each.message) for each in warned if each.category in (ResourceWarning, RuntimeWarning)]
    finally:
        threading.excepthook, sys.unraisablehook = hooks


def test_one_module_makes_event_loops():
    """Who makes a loop by itself gets its end wrong: a close while the thread starts, sockets left open."""
    files = module_files().values()
    makers = {path.name for path in files if LOOPS.search(path.read_text("utf-8"))}
    assert makers == {"event_loop.py"}


def close_a_thread() -> None:
    made().close()


def close_a_thread_that_has_work() -> None:
    with made() as thread:
        thread.spawn(asyncio.Event().wait())


@pytest.mark.parametrize("close", [close_a_thread, close_a_thread_that_has_work])
def test_a_close_after_the_start_leaves_nothing_behind(close: Callable[[], None]):
    threads = threading.active_count()
    with complaints() as found:
        for _ in range(20):
            close()
    assert found == []
    assert threading.active_count() <= threads


def test_a_close_before_the_thread_runs_is_heeded(monkeypatch: pytest.MonkeyPatch):
    """A machine under load starts the thread late: the close waits in the loop's queue."""
    run, late = threading.Thread.run, threading.Event()

    def run_late(self: threading.Thread) -> None:
        late.wait(20)
        run(self)

    monkeypatch.setattr(threading.Thread, "run", run_late)
    with complaints() as found:
        thread = made()
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


def test_a_closed_thread_takes_no_work():
    with complaints() as found:
        thread = made()
        thread.close()
        assert not thread.call(print)
        with pytest.raises(RuntimeError, match="closed"):
            thread.spawn(asyncio.Event().wait())
    assert found == []
