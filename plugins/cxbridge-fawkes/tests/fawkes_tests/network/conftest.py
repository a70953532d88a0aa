"""A server with a board, and its log."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import EventBus, Level, LogLine
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.server import FawkesServer
from fawkes_tests.network.raw import TIMEOUT, RawClient
from tests.blackboard.samples import SampleRegistry
from tests.blackboard.zmq.support import eventually

pytest.register_assert_rewrite("fawkes_tests.network.pairs", "fawkes_tests.network.differences")


class Site:
    """A board and a server that tests can stop and restart."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.clock = RealClock()
        self.bus = EventBus(self.clock)
        self.board = LocalBlackBoard(SampleRegistry(), self.clock, self.bus)
        self.lines: list[Any] = []
        self.bus.subscribe(self.lines.append, LogLine)
        self.server: FawkesServer = None  # type: ignore[assignment] # started by start()

    def start(self, port: int = 0, **options: Any) -> FawkesServer:
        self.server = FawkesServer(self.board, port=port, **options)
        return self._stack.enter_context(self.server)

    def raw(self) -> RawClient:
        return self._stack.enter_context(RawClient(self.server.port))

    def client(self, **options: Any) -> FawkesBlackBoard:
        url = f"fawkes://127.0.0.1:{self.server.port}"
        options = {"timeout": TIMEOUT} | options
        return self._stack.enter_context(
            FawkesBlackBoard(url, SampleRegistry(), self.clock, EventBus(self.clock), **options)
        )

    def warnings(self) -> list[str]:
        return [line.text for line in self.lines if line.level is Level.WARN]

    def wait_warning(self, part: str) -> str:
        """Wait for a warning that contains ``part``, and return the warning."""
        eventually(lambda: any(part in text for text in self.warnings()))
        return next(text for text in self.warnings() if part in text)


@pytest.fixture
def site() -> Iterator[Site]:
    with ExitStack() as stack:
        yield Site(stack)


@pytest.fixture
def served(site: Site) -> Site:
    site.start()
    return site
