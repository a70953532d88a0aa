"""Clients that do not read cost bounded memory and no time of the loop."""

from __future__ import annotations

import asyncio
import socket
import threading
from collections import deque
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

from cxbridge.events import Level, LogLine
from cxbridge_web import event_streams
from cxbridge_web.event_buffer import BUNCH_BYTES, EventBuffer
from cxbridge_web.event_streams import EventStreams
from tests.daemon.test_daemon import WAIT_S
from web_tests.support import read_events, serving

HOST: Any = SimpleNamespace(bus=SimpleNamespace(clock=SimpleNamespace(now_us=lambda: 1)))
LINE = LogLine(1, Level.INFO, "C", "x" * 1000)


class EventCollector:
    """A collector with the test's events instead of those of a bus."""

    def __init__(self) -> None:
        self.events: deque[LogLine] = deque()

    def change_requests(self, kinds: Any, *, add: bool) -> None:
        pass

    def take_events(self) -> tuple[list[Any], int]:
        events = list(self.events)
        self.events.clear()
        return events, 0


async def wait_until(reached: Callable[[], bool]) -> None:
    while not reached():  # noqa: ASYNC110 - further tasks continue, and no task has an event to wait for
        await asyncio.sleep(0.01)


def scope() -> dict[str, Any]:
    return {"type": "http", "method": "GET", "path": "/", "headers": [], "query_string": b"kinds=log"}


def test_stopped_client_holds_single_bunch_and_gets_loss_count():
    """The stream waits for the connection; the buffer keeps the events of the wait up to its limit."""
    collector, buffer = EventCollector(), EventBuffer(max_events=100)
    sent: list[bytes] = []

    async def scenario() -> None:
        streams = EventStreams(HOST, collector, buffer)  # type: ignore[arg-type]  # a double
        resumed, first = asyncio.Event(), asyncio.Event()

        async def send(message: Any) -> None:
            if message["type"] == "http.response.body":
                sent.append(message["body"])
                if b"event: hello" in message["body"]:
                    first.set()
                elif not resumed.is_set():
                    await resumed.wait()

        async def receive() -> Any:
            await asyncio.Event().wait()

        following = asyncio.create_task(streams(scope(), receive, send))
        await first.wait()
        collector.events.append(LINE)
        await wait_until(lambda: len(sent) == 2)
        for _ in range(5):
            collector.events.extend([LINE] * 100)
            await wait_until(lambda: not collector.events)
        assert len(sent) == 2
        assert sum(buffer.end.counts) - sum(buffer.begin.counts) == 100
        resumed.set()
        await wait_until(lambda: sent[-1].count(b"data: ") > 1 and len(sent[-1]) < BUNCH_BYTES)
        streams.close()
        await asyncio.wait_for(following, WAIT_S)

    asyncio.run(asyncio.wait_for(scenario(), WAIT_S))
    assert max(map(len, sent)) < BUNCH_BYTES + 4000
    assert b'event: dropped\ndata: {"kind": "dropped", "count": 400}' in b"".join(sent)


def test_loop_continues_with_client_that_does_not_read():
    with serving((("executive", False),)) as (daemon, client, _):
        port = int(client.url.rpartition(":")[2])
        silent = socket.socket()
        silent.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        silent.connect(("127.0.0.1", port))
        silent.sendall(b"GET /api/cxbridge/events?kinds=log HTTP/1.1\r\nHost: localhost\r\n\r\n")
        client.until("/api/cxbridge/status", lambda status: status["web"]["clients"] == 1)
        log, pause = daemon.bus.logger("Test"), threading.Event()
        with client.open("GET", "/api/cxbridge/events?kinds=log") as stream:
            events = read_events(stream)
            next(events)
            loops = daemon.loop.cycle_count
            for _ in range(20):
                for _ in range(1000):
                    log.debug("y" * 1000)
                pause.wait(0.06)
            log.debug("the end")
            for _, _, data in events:
                if data.get("text") == "the end":
                    break
            assert daemon.loop.cycle_count > loops
            status = client.get("/api/cxbridge/status").json
            assert status["web"]["clients"] == 2
        silent.close()
        client.until("/api/cxbridge/status", lambda status: status["web"]["clients"] == 0)


def test_stream_sends_keep_alive(monkeypatch):
    collector = EventCollector()
    alive = asyncio.Event()
    monkeypatch.setattr(event_streams, "KEEP_ALIVE_S", 0.01)

    async def scenario() -> None:
        streams = EventStreams(HOST, collector)  # type: ignore[arg-type]  # a double

        async def send(message: Any) -> None:
            if message.get("body") == b": alive\n\n":
                alive.set()

        async def receive() -> Any:
            await alive.wait()
            return {"type": "http.disconnect"}

        await streams(scope(), receive, send)
        assert streams.client_count == 0

    asyncio.run(asyncio.wait_for(scenario(), WAIT_S))
    assert alive.is_set()
