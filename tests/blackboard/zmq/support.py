"""A server and clients in the process of the tests."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus, LogLine
from tests.blackboard.samples import SampleRegistry

LONG = 20.0
"""The limit in seconds for operations that take milliseconds on an idle machine."""


def endpoint_of(transport: str, folder: Path) -> str:
    """Return an unused endpoint."""
    return {"ipc": f"ipc://{folder}/board", "tcp": "tcp://127.0.0.1:*"}[transport]


def eventually(condition: Callable[[], object], timeout: float = LONG) -> None:
    """Wait until ``condition`` is true; fail after the timeout."""
    deadline = time.monotonic() + timeout
    while not condition():
        assert time.monotonic() < deadline, "the condition did not become true"
        time.sleep(0.005)


class Bench:
    """A server with its local blackboard, and its clients."""

    def __init__(self, transport: str, folder: Path, **options: Any) -> None:
        self.clock = VirtualClock()
        self.bus = EventBus(self.clock)
        self.board = LocalBlackBoard(SampleRegistry(), self.clock, self.bus)
        self.server = ZmqBlackBoardServer(self.board, [endpoint_of(transport, folder)], **options)
        self.clients: list[ZmqBlackBoard] = []

    @property
    def url(self) -> str:
        return self.server.endpoints[0]

    def client(self, **options: Any) -> ZmqBlackBoard:
        settings: dict[str, Any] = {"timeout": LONG, "connect_timeout": LONG} | options
        board = ZmqBlackBoard(self.url, SampleRegistry(), self.clock, self.bus, **settings)
        self.clients.append(board)
        return board

    def collect_lines(self) -> list[Any]:
        """Return a list to which the bus adds log lines."""
        lines: list[Any] = []
        self.bus.subscribe(lines.append, LogLine)
        return lines

    def shut_down_clients(self) -> None:
        for client in self.clients:
            client.shutdown()

    def settle(self) -> None:
        """Wait until the effects of all clients have arrived at all clients."""
        for client in (*self.clients, *self.clients):
            if not client._is_shut_down:
                client.flush()


@contextmanager
def bench(transport: str, folder: Path, **options: Any) -> Iterator[Bench]:
    """Start a server; close everything at the end."""
    served = Bench(transport, folder, **options)
    with ExitStack() as stack:
        served.server.start()
        stack.callback(lambda: served.server.stop())  # noqa: PLW0108 - tests replace it
        stack.callback(served.shut_down_clients)
        yield served
