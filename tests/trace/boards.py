"""Blackboards of all transports for recorders: the board of a server, and clients of the server."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any, Self

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.urls import open_blackboard
from cxbridge.blackboard.zmq.server import ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.events import EventBus
from cxbridge.interfaces import InterfaceRegistry
from tests.fawkes import TRANSPORT, fawkes_server

REMOTE = ("ipc", "tcp", *TRANSPORT)
TRANSPORTS = ("local", *REMOTE)
WAIT_S = 20


class Site:
    """A context manager of a blackboard, with a server unless the blackboard is local."""

    def __init__(self, transport: str, folder: Path, *interface_dirs: Path) -> None:
        self.transport = transport
        self.registry = InterfaceRegistry(interface_dirs)
        self.url = f"ipc://{folder}/bb" if transport == "ipc" else "tcp://127.0.0.1:*"
        self._port = 0
        self.up()

    def up(self) -> None:
        """Start with an empty blackboard, or restart."""
        clock = RealClock()
        self.board = LocalBlackBoard(self.registry, clock, EventBus(clock))
        self._server: Any = None
        if self.transport == "fawkes":
            self._server = fawkes_server(self.board, self._port)
            self._server.start()
            self._port = self._server.port
            self.url = f"fawkes://127.0.0.1:{self._port}"
        elif self.transport != "local":
            self._server = ZmqBlackBoardServer(self.board, [self.url], heartbeat=0.2)
            self._server.start()
            self.url = self._server.endpoints[0]

    def down(self) -> None:
        """Stop the server and the blackboard."""
        if self._server is not None:
            self._server.stop()
        self.board.shutdown()

    def connect(self) -> BlackBoard:
        """Return a client's blackboard, or the local blackboard."""
        if self.transport == "local":
            return self.board
        clock = RealClock()
        return open_blackboard(self.url, InterfaceRegistry(), clock, EventBus(clock))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.down()


def until(condition: Callable[[], object]) -> None:
    """Wait until a condition holds; fail after WAIT_S."""
    pause = threading.Event()
    for _ in range(WAIT_S * 100):
        if condition():
            return
        pause.wait(0.01)
    raise AssertionError("the condition does not hold")
