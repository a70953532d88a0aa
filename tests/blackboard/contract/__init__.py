"""The contract of the blackboards of all transports.

The tests of a transport derive a class from each contract and define the fixture ``pair``::

    class LocalPair:
        @pytest.fixture
        def pair(self): ...

    class TestOpening(LocalPair, OpeningContract): ...
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import pytest

from cxbridge.blackboard import BlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import Event, EventBus
from tests.blackboard.samples import SampleInterface


def _settle_at_once() -> None:
    pass


@dataclass
class BoardPair:
    """Two boards with the same interfaces: two clients of a remote blackboard, or the same local board twice.

    :param near: the board on which tests read and listen.
    :param far: the board on which tests write.
    :param clock: the clock of the board that stores the interfaces.
    :param bus: the bus of the board that stores the interfaces.
    :param settle: waits until the effects of each board have arrived at the other board.
    """

    near: BlackBoard
    far: BlackBoard
    clock: VirtualClock
    bus: EventBus
    settle: Callable[[], None] = field(default=_settle_at_once)

    def publish(self, writer: Any, **values: object) -> None:
        """Set fields of a writer, write, and wait until the write has arrived."""
        for name, value in values.items():
            setattr(writer, name, value)
        writer.write()
        self.settle()

    def collect(self, *event_types: type[Event]) -> list[Any]:
        """Return a list that grows with the events of the bus."""
        events: list[Any] = []
        self.bus.subscribe(events.append, *event_types)
        return events


class Contract:
    """Base class of contracts."""

    @pytest.fixture
    def pair(self) -> BoardPair:
        raise NotImplementedError

    @pytest.fixture
    def reader(self, pair: BoardPair) -> Any:
        return pair.near.open_for_reading(SampleInterface, "a", owner="r")

    @pytest.fixture
    def writer(self, pair: BoardPair, reader: Any) -> Any:
        writer = pair.far.open_for_writing(SampleInterface, "a", owner="w")
        pair.settle()
        return writer
