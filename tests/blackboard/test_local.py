"""The contract of all blackboards, on the one in this process."""

from __future__ import annotations

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from tests.blackboard.contract import BoardPair
from tests.blackboard.contract.opening import OpeningContract
from tests.blackboard.samples import SampleRegistry


class LocalPair:
    @pytest.fixture
    def pair(self) -> BoardPair:
        clock = VirtualClock()
        bus = EventBus(clock)
        board = LocalBlackBoard(SampleRegistry(), clock, bus)
        return BoardPair(near=board, far=board, clock=clock, bus=bus)


class TestOpening(LocalPair, OpeningContract):
    pass
