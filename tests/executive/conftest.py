"""CLIPS environments for tests."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from cxbridge.clock import VirtualClock
from cxbridge.events import Event, EventBus, Level, LogLine
from cxbridge.executive.host.environment import ClipsEnvironment
from tests.executive.core.core_bench import Bench


class Log:
    """Keeps the log lines of a bus."""

    def __init__(self, bus: EventBus) -> None:
        self.lines: list[LogLine] = []
        bus.subscribe(self._take, LogLine)

    def _take(self, event: Event) -> None:
        assert isinstance(event, LogLine)
        self.lines.append(event)

    def texts(self, *levels: Level) -> list[str]:
        """The texts of the lines at these levels; of all without any."""
        return [line.text for line in self.lines if not levels or line.level in levels]


@pytest.fixture
def bus() -> EventBus:
    """A bus on a virtual clock."""
    return EventBus(VirtualClock())


@pytest.fixture
def log(bus: EventBus) -> Log:
    """The log lines of the bus."""
    return Log(bus)


@pytest.fixture
def env(bus: EventBus, log: Log) -> Iterator[ClipsEnvironment]:
    """An environment with nothing loaded."""
    environment = ClipsEnvironment("executive", bus)
    yield environment
    environment.destroy()


@pytest.fixture(autouse=True)
def _no_bench_is_left() -> Iterator[None]:
    """Close the benches of a test, but not shared benches."""
    Bench.made.clear()
    yield
    for bench in Bench.made:
        bench.close()


@pytest.fixture
def clp(tmp_path: Path):
    """Write a CLIPS file and return its path."""

    def write(text: str, name: str = "test.clp") -> Path:
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
        return path

    return write
