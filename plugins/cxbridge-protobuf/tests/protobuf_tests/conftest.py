"""Message types and networks for tests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pytest

from cxbridge_protobuf import compiler
from cxbridge_protobuf.inbox import ConnectionChange, InboxEvent, LogWarning, ReceivedMessage
from cxbridge_protobuf.socket_connections import SocketConnections
from cxbridge_protobuf.types import MessageTypes
from tests.blackboard.zmq.support import eventually
from tests.executive.conftest import bus, env, log
from tests.support import ROOT

__all__ = ["bus", "env", "log"]  # fixtures

PROTOS = ROOT / "tests" / "protos"
WAIT = 30  # seconds
T = TypeVar("T")


class Net(SocketConnections):
    """A network with methods that wait for events."""

    def __init__(self, types: MessageTypes, server_address: str) -> None:
        super().__init__(types, lambda: 7, server_address)
        self.events: list[InboxEvent] = []

    def wait(self, count: int, kind: type[T]) -> list[T]:
        """Wait for ``count`` events of a kind, and return the events."""

        def has_arrived():
            self.events += self.drain()
            return sum(isinstance(event, kind) for event in self.events) >= count

        eventually(has_arrived)
        found: list[Any] = [event for event in self.events if isinstance(event, kind)][:count]
        self.events = [event for event in self.events if all(event is not taken for taken in found)]
        return found

    def message(self) -> ReceivedMessage:
        (event,) = self.wait(1, ReceivedMessage)
        return event

    def presence(self) -> ConnectionChange:
        (event,) = self.wait(1, ConnectionChange)
        return event

    def warning(self) -> str:
        (event,) = self.wait(1, LogWarning)
        return event.text


_compiled: dict[object, bytes] = {}
_compile = compiler.compile_files


def _compile_once(names: Sequence[str], directory: Path, path: Sequence[Path]) -> bytes:
    """Compile like :mod:`cxbridge_protobuf.compiler`, but start only one process for equal files."""
    texts = tuple(
        (file.relative_to(folder), file.read_bytes())
        for folder in path
        for file in sorted(folder.rglob("*.proto"))
    )
    key = (*names, texts)
    if key not in _compiled:
        _compiled[key] = _compile(names, directory, path)
    return _compiled[key]


@pytest.fixture(autouse=True, scope="session")
def _fast_compiler() -> Iterator[None]:
    """Compile equal .proto files once, since the compiler is slow and most tests need the same files."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiler, "compile_files", _compile_once)
        yield


@pytest.fixture
def types():
    problems: list[str] = []
    known = MessageTypes(problems.append)
    known.add_folders([PROTOS])
    assert not problems
    return known


@pytest.fixture
def nets(types):
    """Return a function that opens networks, which the fixture closes."""
    opened = []

    def open_net(server_address="127.0.0.1"):
        opened.append(Net(types, server_address))
        return opened[-1]

    yield open_net
    for net in opened:
        net.close()
