"""What every blackboard must do, whatever its transport.

A transport's tests derive a class from each contract and give the fixture ``pair``::

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


def _nothing_to_wait_for() -> None:
    pass


@dataclass
class BoardPair:
    """Two ways to the same interfaces: two clients of a remote blackboard, or twice the same local one.

    :param near: where the tests read and listen.
    :param far: where they write.
    :param clock: of the board that keeps the interfaces.
    :param bus: of that board.
    :param settle: returns when everything that was done on one side has arrived at the other.
    """

    near: BlackBoard
    far: BlackBoard
    clock: VirtualClock
    bus: EventBus
    settle: Callable[[], None] = field(default=_nothing_to_wait_for)

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
    """Base of the contracts."""

    @pytest.fixture
    def pair(self) -> BoardPair:
        raise NotImplementedError
