"""A server of Fawkes' protocol and its clients, for the state machine."""

from __future__ import annotations

from typing import Any

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.server import FawkesServer
from fawkes_tests.network.pairs import TIMEOUT
from tests.blackboard.samples import SampleRegistry
from tests.blackboard.sites import Site
from tests.blackboard.zmq.support import eventually


class FawkesSite(Site):
    """A server of Fawkes' protocol, which has no acknowledgements (docs/evidence/protocol-fawkes.md)."""

    acknowledges = False
    keeps = False
    exact = False

    def __init__(self, window: int) -> None:
        super().__init__(window)
        self.board = LocalBlackBoard(SampleRegistry(), self.clock)
        self.server = FawkesServer(self.board, port=0)
        self.server.start()

    def connect(self, name: str) -> BlackBoard:
        del name
        client = FawkesBlackBoard(
            f"fawkes://127.0.0.1:{self.server.port}", SampleRegistry(), self.clock, timeout=TIMEOUT
        )
        self.clients.append(client)
        return client

    def settle(self) -> None:
        for client in (*self.clients, *self.clients):
            client.flush()

    def kill(self, client: Any) -> None:
        self.clients.remove(client)
        client._reconnector._stopping.set()
        client._requests.connection.abort("killed")
        client.shutdown()

    def wait_reaped(self) -> None:
        eventually(lambda: len(self.server._sessions) == len(self.clients))
        self.settle()  # the server ends noticed sessions before its answer

    def stop(self) -> None:
        self.server.stop()
        self.board.shutdown()
        eventually(lambda: not any(client.connected for client in self.clients))

    def start(self) -> None:
        self.board = LocalBlackBoard(SampleRegistry(), self.clock)
        self.server = FawkesServer(self.board, port=self.server.port)
        self.server.start()
        eventually(lambda: all(client.connected for client in self.clients))

    def close(self) -> None:
        for client in self.clients:
            client.shutdown()
        self.server.stop()
