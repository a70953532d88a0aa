"""Message types and networks for tests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pytest

from cxbridge_protobuf import compiler
from cxbridge_protobuf.inbox import ConnectionChange, InboxEvent, LogWarning, ReceivedMessage
from cxbridge_protobuf.network import Network
from cxbridge_protobuf.types import MessageTypes
from tests.blackboard.zmq.support import eventually
from tests.executive.conftest import bus, env, log
from tests.support import ROOT

__all__ = ["bus", "env", "log"]  # fixtures

PROTOS = ROOT / "tests" / "protos"
WAIT = 30  # seconds
T = TypeVar("T")


class Net(Network):
    """A network with methods that wait for events."""

    def __init__(self, types: MessageTypes, server_address: str) -> None:
        super().__init__(types, lambda: 7, server_address)
        self.seen: list[InboxEvent] = []

    def wait(self, count: int, kind: type[T]) -> list[T]:
        """Wait for a number of events of a kind, and return them."""

        def there():
            self.seen += self.drain()
            return sum(isinstance(event, kind) for event in self.seen) >= count

        eventually(there)
        found: list[Any] = [event for event in self.seen if isinstance(event, kind)][:count]
        self.seen = [event for event in self.seen if all(event is not other for other in found)]
        return found

    def message(self) -> ReceivedMessage:
        (event,) = self.wait(1, ReceivedMessage)
        return event

    def presence(self) -> ConnectionChange:
        (event,) = self.wait(1, ConnectionChange)
        return event

    def warned(self) -> str:
        (event,) = self.wait(1, LogWarning)
        return event.text


_compiled: dict[object, bytes] = {}
_compile = compiler.compile_files


def _compile_once(names: Sequence[str], here: Path, path: Sequence[Path]) -> bytes:
    """Compile like :mod:`cxbridge_protobuf.compiler`, but start a process only once for the same files."""
    texts = tuple(
        (file.relative_to(folder), file.read_bytes())
        for folder in path
        for file in sorted(folder.rglob("*.proto"))
    )
    key = (*names, texts)
    if key not in _compiled:
        _compiled[key] = _compile(names, here, path)
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
    """Makes networks, and closes them."""
    made = []

    def make(server_address="127.0.0.1"):
        made.append(Net(types, server_address))
        return made[-1]

    yield make
    for net in made:
        net.close()
