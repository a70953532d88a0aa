"""The contract of all blackboards, between two clients of a server, on each transport of ZeroMQ."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.blackboard.contract import BoardPair
from tests.blackboard.contract.data import DataContract
from tests.blackboard.contract.events import EventsContract, RegistrationContract
from tests.blackboard.contract.messages import MessagesContract
from tests.blackboard.contract.observers import ObserversContract
from tests.blackboard.contract.opening import OpeningContract
from tests.blackboard.zmq.support import bench


class ZmqPair:
    @pytest.fixture(params=["inproc", "ipc", "tcp"])
    def pair(self, request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[BoardPair]:
        with bench(request.param, tmp_path) as made:
            near, far = made.client(name="near"), made.client(name="far")
            yield BoardPair(near=near, far=far, clock=made.clock, bus=made.bus, settle=made.settle)


class TestOpening(ZmqPair, OpeningContract):
    pass


class TestData(ZmqPair, DataContract):
    pass


class TestMessages(ZmqPair, MessagesContract):
    pass


class TestRegistration(ZmqPair, RegistrationContract):
    pass


class TestEvents(ZmqPair, EventsContract):
    pass


class TestObservers(ZmqPair, ObserversContract):
    pass
