"""A thread with an event loop may be closed at any moment: while it starts, while it serves, twice."""

from __future__ import annotations

import asyncio
import gc
import re
import socket
import sys
import threading
import warnings
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress

import pytest

from cxbridge.blackboard.kit.event_loop import LoopThread
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from tests.support import module_files

LOOPS = re.compile(r"new_event_loop|asyncio\.run\(|Runner\(|run_until_complete|run_forever")
TIMES = 20


def made() -> LoopThread:
    return LoopThread("tested")


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port: int = listening.getsockname()[1]
        return port


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


def close_a_network() -> None:
    pytest.importorskip("cxbridge_protobuf", reason="needs cxbridge-protobuf")
    from cxbridge_protobuf.network import Network
    from cxbridge_protobuf.settings import NetworkSettings
    from cxbridge_protobuf.types import MessageTypes

    network = Network(MessageTypes(lambda _text: None), NetworkSettings(), lambda: 0)
    network.enable_server(free_port())
    network.connect("127.0.0.1", free_port())
    network.close()
    network.close()


def close_a_web_server() -> None:
    pytest.importorskip("cxbridge_web", reason="needs cxbridge-web")
    from starlette.responses import PlainTextResponse

    from cxbridge_web.http.serving import HttpThread
    from cxbridge_web.settings import WebSettings

    server = HttpThread(WebSettings(port=0), EventBus(RealClock()).logger("Web"))
    server.start(PlainTextResponse("here"))
    server.stop()
    server.stop()


def close_the_door_of_foxglove() -> None:
    pytest.importorskip("cxbridge_web", reason="needs cxbridge-web")
    pytest.importorskip("foxglove", reason="needs foxglove-sdk")
    from cxbridge_web.foxglove.proxy import FoxgloveProxy
    from cxbridge_web.foxglove.settings import FoxgloveSettings

    door = FoxgloveProxy(FoxgloveSettings(port=0), ("127.0.0.1", 1))
    door.close()
    door.close()
    with socket.socket() as client:
        assert client.connect_ex(("127.0.0.1", door.port)) != 0


@pytest.mark.parametrize(
    ("close", "times"),
    [
        (close_a_thread, TIMES),
        (close_a_thread_that_has_work, TIMES),
        (close_a_network, TIMES),
        (close_a_web_server, 2),  # uvicorn takes its time
        (close_the_door_of_foxglove, TIMES),
    ],
)
def test_a_close_after_the_start_leaves_nothing_behind(close: Callable[[], None], times: int):
    threads = threading.active_count()
    with complaints() as found:
        for _ in range(times):
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
