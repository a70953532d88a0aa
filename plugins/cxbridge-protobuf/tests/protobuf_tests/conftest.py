"""Message types and networks for tests."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, TypeVar

import pytest

from cxbridge_protobuf import compiler
from cxbridge_protobuf.inbox import ConnectionChange, InboxEvent, LogWarning, ReceivedMessage
from cxbridge_protobuf.network import Network
from cxbridge_protobuf.settings import NetworkSettings
from cxbridge_protobuf.types import MessageTypes
from tests.executive.conftest import bus, env, log
from tests.support import ROOT

__all__ = ["bus", "env", "log"]  # fixtures

PROTOS = ROOT / "tests" / "protos"
WAIT = 30
T = TypeVar("T")


class Net(Network):
    """A network whose inbox can be waited for."""

    def __init__(self, types: MessageTypes, settings: NetworkSettings) -> None:
        super().__init__(types, settings, lambda: 7)
        self.seen: list[InboxEvent] = []
        self._arrived = threading.Condition()
        put, warn = self.inbox.add_event, self.inbox.warn

        def tell(function):
            def told(*args, **kwargs):
                function(*args, **kwargs)
                with self._arrived:
                    self._arrived.notify_all()

            return told

        self.inbox.add_event = tell(put)  # type: ignore[method-assign]
        self.inbox.warn = tell(warn)  # type: ignore[method-assign]

    def wait(self, count: int, kind: type[T]) -> list[T]:
        """Wait for a number of events of a kind, and return them."""

        def there():
            self.seen += self.drain()
            return sum(isinstance(event, kind) for event in self.seen) >= count

        with self._arrived:
            assert self._arrived.wait_for(there, WAIT), self.seen
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


_compiled: dict[object, tuple[bytes | None, str]] = {}
_compile = compiler._compile_files


def _compile_once(names: Sequence[str], here: Path, path: Sequence[Path]) -> tuple[bytes | None, str]:
    """What :mod:`cxbridge_protobuf.compiler` does, a process each time, once for the same files."""
    texts = tuple(
        (file.relative_to(folder), file.read_bytes())
        for folder in path
        for file in sorted(folder.rglob("*.proto"))
    )
    key = (*compiler._find_compiler(), compiler._COMPILER_TIMEOUT_S, *names, texts)
    if key not in _compiled:
        _compiled[key] = _compile(names, here, path)
    return _compiled[key]


@pytest.fixture(autouse=True, scope="session")
def _fast_compiler() -> Iterator[None]:
    """The compiler of .proto files takes its time, and most tests want the same of it."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(compiler, "_compile_files", _compile_once)
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

    def make(**settings):
        made.append(Net(types, NetworkSettings(**settings)))
        return made[-1]

    yield make
    for net in made:
        net.close()
