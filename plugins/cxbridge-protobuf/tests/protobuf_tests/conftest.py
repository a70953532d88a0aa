"""Message types and networks for tests."""

from __future__ import annotations

import os
import random
import socket
import threading
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

import pytest

from cxbridge_protobuf.inbox import Event, Presence, Received, Warned
from cxbridge_protobuf.network import Network
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import MessageTypes

PROTOS = Path(__file__).parent / "protos"
WAIT = 30
T = TypeVar("T")


class Net(Network):
    """A network whose inbox can be waited for."""

    def __init__(self, types: MessageTypes, settings: NetworkSettings) -> None:
        super().__init__(types, settings, lambda: 7)
        self.seen: list[Event] = []
        self._arrived = threading.Condition()
        put, warn = self.inbox.put, self.inbox.warn

        def tell(function):
            def told(*args, **kwargs):
                function(*args, **kwargs)
                with self._arrived:
                    self._arrived.notify_all()

            return told

        self.inbox.put = tell(put)  # type: ignore[method-assign]
        self.inbox.warn = tell(warn)  # type: ignore[method-assign]

    def wait(self, count: int, kind: type[T]) -> list[T]:
        """Wait for so many events of a kind, and return them."""

        def there():
            self.seen += self.drain()
            return sum(isinstance(event, kind) for event in self.seen) >= count

        with self._arrived:
            assert self._arrived.wait_for(there, WAIT), self.seen
        found: list[Any] = [event for event in self.seen if isinstance(event, kind)][:count]
        self.seen = [event for event in self.seen if all(event is not other for other in found)]
        return found

    def message(self) -> Received:
        (event,) = self.wait(1, Received)
        return event

    def presence(self) -> Presence:
        (event,) = self.wait(1, Presence)
        return event

    def warned(self) -> str:
        (event,) = self.wait(1, Warned)
        return event.text


@pytest.fixture(scope="session")
def compiled():
    """Skips without a .proto compiler."""
    return pytest.importorskip("grpc_tools", reason="the extra 'protobuf' (grpcio-tools) is not installed")


@pytest.fixture
def types(compiled):
    problems: list[str] = []
    known = MessageTypes(problems.append)
    known.add_folders([PROTOS])
    assert not problems
    return known


@pytest.fixture
def nets(types):
    """Makes networks, and closes them."""
    made = []

    def make(**settings):
        made.append(Net(types, NetworkSettings(**settings)))
        return made[-1]

    yield make
    for net in made:
        net.close()


_SLICE = 1_500
_WORKER = int("0" + os.environ.get("PYTEST_XDIST_WORKER", "").lstrip("gw")) % 8
_START = random.randrange(_SLICE)
_UNTRIED = (20_000 + _SLICE * _WORKER + (_START + step) % _SLICE for step in range(_SLICE))
"""Below the ports that the system hands out; each once, and none that another worker tries."""


def free_port(kind: int = socket.SOCK_STREAM) -> int:
    """A port that nobody uses now, nor any other test of this run."""
    for port in _UNTRIED:
        with socket.socket(socket.AF_INET, kind) as probe, suppress(OSError):
            probe.bind(("127.0.0.1", port))
            return port
    raise AssertionError("no port is left")
