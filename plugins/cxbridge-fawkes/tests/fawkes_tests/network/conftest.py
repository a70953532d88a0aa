"""A server with a board, and its log."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from typing import Any

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import RealClock
from cxbridge.events import Event, EventBus, Level, LogLine
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.server import FawkesServer
from fawkes_tests.network.raw import TIMEOUT, RawClient
from tests.blackboard.samples import SampleRegistry

pytest.register_assert_rewrite("fawkes_tests.network.pairs", "fawkes_tests.network.differences")


class Site:
    """A board and a server that can be stopped and started again."""

    def __init__(self, stack: ExitStack) -> None:
        self._stack = stack
        self.clock = RealClock()
        self.bus = EventBus(self.clock)
        self.board = LocalBlackBoard(SampleRegistry(), self.clock, self.bus)
        self.lines: list[LogLine] = []
        self._news = threading.Condition()
        self.bus.subscribe(self._note, LogLine)
        self.server: FawkesServer = None  # type: ignore[assignment] # started by start()

    def start(self, port: int = 0, **options: Any) -> FawkesServer:
        self.server = FawkesServer(self.board, port=port, **options)
        return self._stack.enter_context(self.server)

    def raw(self) -> RawClient:
        client = RawClient(self.server.port)
        self._stack.callback(client.close)
        return client

    def client(self, **options: Any) -> FawkesBlackBoard:
        url = f"fawkes://127.0.0.1:{self.server.port}"
        options = {"timeout": TIMEOUT} | options
        return self._stack.enter_context(
            FawkesBlackBoard(url, SampleRegistry(), self.clock, EventBus(self.clock), **options)
        )

    def _note(self, event: Event) -> None:
        assert isinstance(event, LogLine)
        with self._news:
            self.lines.append(event)
            self._news.notify_all()

    def wait_for(self, met: Callable[[], bool]) -> bool:
        """Wait until a log line makes ``met`` true."""
        with self._news:
            return self._news.wait_for(met, TIMEOUT)

    def warnings(self) -> list[str]:
        return [line.text for line in self.lines if line.level is Level.WARN]

    def wait_warning(self, part: str) -> str:
        """Wait for a warning with these words and return it."""
        assert self.wait_for(lambda: any(part in text for text in self.warnings())), self.warnings()
        return next(text for text in self.warnings() if part in text)


@pytest.fixture
def site() -> Iterator[Site]:
    with ExitStack() as stack:
        yield Site(stack)


@pytest.fixture
def served(site: Site) -> Site:
    site.start()
    return site
