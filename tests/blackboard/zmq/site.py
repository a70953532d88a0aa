"""A ZeroMQ server and its clients, for the state machine."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.blackboard.zmq.wire.frames import Beat
from tests.blackboard.samples import SampleRegistry
from tests.blackboard.sites import Site
from tests.blackboard.zmq.support import Bench, eventually


class ZmqSite(Site):
    """A ZeroMQ server.

    :param transport: ``ipc`` or ``tcp``.
    """

    def __init__(self, transport: str, folder: Path, window: int) -> None:
        super().__init__(window)
        self.bench = Bench(transport, folder, window=window)
        self.board, self.server = self.bench.board, self.bench.server
        self.server.start()

    def connect(self, name: str) -> BlackBoard:
        client = self.bench.client(name=name)
        self.clients.append(client)
        return client

    def settle(self) -> None:
        while True:
            for client in (*self.clients, *self.clients):
                client.flush()
            if not any(session.waiting_channels for session in tuple(self.server._sessions.values())):
                break  # otherwise an update waits for credit
        for client in self.clients:
            client.flush()

    def kill(self, client: Any) -> None:
        self.clients.remove(client)
        self.bench.clients.remove(client)
        client._sender.detach()  # the client sends no frames, not even Bye
        client.shutdown()

    def wait_reaped(self) -> None:
        def all_noticed() -> bool:
            self.server.post(self._beat)
            return self.server.session_count == len(self.clients)

        eventually(all_noticed)

    def _beat(self) -> None:
        """Send heartbeats before they are due, because a failed send shows a dead connection."""
        for session in tuple(self.server._sessions.values()):
            session.send(Beat())

    def stop(self) -> None:
        self.server.stop()
        self.board.shutdown()
        eventually(lambda: not any(client.connected for client in self.clients))

    def start(self) -> None:
        bench = self.bench
        self.board = bench.board = LocalBlackBoard(SampleRegistry(), self.clock, bench.bus)
        self.server = bench.server = type(self.server)(self.board, self.server.endpoints, window=self.window)
        self.server.start()
        eventually(lambda: all(client.connected for client in self.clients))

    def close(self) -> None:
        self.bench.shut_down_clients()
        self.server.stop()

    @contextmanager
    def not_reading(self, client: Any) -> Iterator[None]:
        resume = threading.Event()
        receiver = client._dispatcher
        handle_frame_bytes = receiver._handle_frame_bytes

        def take(frame_bytes: bytes) -> None:
            resume.wait()
            handle_frame_bytes(frame_bytes)

        receiver._handle_frame_bytes = take
        try:
            yield
        finally:
            receiver._handle_frame_bytes = handle_frame_bytes
            resume.set()

    def skipped(self, client: Any) -> int:
        return int(getattr(client, "skipped", 0))
