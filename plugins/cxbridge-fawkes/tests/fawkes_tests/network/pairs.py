"""Blackboards for the contracts: two clients of a server, or a client and the served board."""

from __future__ import annotations

from contextlib import ExitStack
from typing import Any

import pytest

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus, LogLine
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.server import FawkesServer
from tests.blackboard.contract import BoardPair
from tests.blackboard.samples import SampleInterface, SampleRegistry

TIMEOUT = 20.0
"""Seconds: generous, for machines under load."""


def log_only(bus: EventBus) -> EventBus:
    """Return a bus that forwards only log lines, because the client's writes repeat those of the board."""
    forwarding = EventBus(bus.clock)
    forwarding.subscribe(bus.emit, LogLine)
    return forwarding


def make_pair(stack: ExitStack, near_is_remote: bool, far_is_remote: bool) -> BoardPair:
    """Serve a local board; an end that is not remote is the local board."""
    clock = VirtualClock()
    bus = EventBus(clock)
    local = LocalBlackBoard(SampleRegistry(), clock, bus)
    server = stack.enter_context(FawkesServer(local, port=0, bus=EventBus(clock)))

    def board(remote: bool) -> BlackBoard:
        if not remote:
            return local
        url = f"fawkes://127.0.0.1:{server.port}"
        return stack.enter_context(
            FawkesBlackBoard(url, SampleRegistry(), clock, log_only(bus), timeout=TIMEOUT)
        )

    near, far = board(near_is_remote), board(far_is_remote)

    def settle() -> None:
        for _ in range(2):  # a listener at one side may write at the opposite side
            for end in (far, near, far):
                if isinstance(end, FawkesBlackBoard):
                    end.flush()

    return BoardPair(near=near, far=far, clock=clock, bus=bus, settle=settle)


class SettledInstances:
    """The contracts' instances, which both ends know."""

    @pytest.fixture
    def reader(self, pair: BoardPair) -> Any:
        reader = pair.near.open_for_reading(SampleInterface, "a", owner="r")
        pair.settle()
        return reader

    @pytest.fixture
    def writer(self, pair: BoardPair, reader: Any) -> Any:
        writer = pair.far.open_for_writing(SampleInterface, "a", owner="w")
        pair.settle()
        return writer
