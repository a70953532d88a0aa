"""Fixtures of the robot memory; the fixture ``store`` has all available kinds of stores."""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.config import Configuration
from cxbridge.events import EventBus
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.memory import RobotMemory
from cxbridge_robot_memory.split import SplitStore
from cxbridge_robot_memory.store import Store
from tests.executive.conftest import bus, log
from tests.executive.features.conftest import board

if TYPE_CHECKING:
    from robot_memory_tests.mongo_server import MongoServer

REAL = os.environ.get("CXBRIDGE_TEST_MONGODB", "")
"""The URI of a real replica set; the tests empty its database `robmem`."""

KINDS = [
    "embedded",
    "split",
    "wire",
    pytest.param(
        "mongodb",
        marks=pytest.mark.skipif(not REAL, reason="CXBRIDGE_TEST_MONGODB names no MongoDB replica set"),
    ),
]


__all__ = ["board", "bus", "log"]  # fixtures


@pytest.fixture
def memory(bus: EventBus, board: LocalBlackBoard) -> Iterator[RobotMemory]:
    memory = RobotMemory(Configuration(), bus.clock, bus, board)
    yield memory
    memory.close()


@pytest.fixture
def clock() -> VirtualClock:
    return VirtualClock()


@pytest.fixture(scope="session")
def server() -> Iterator[MongoServer]:
    """A server that speaks MongoDB's protocol."""
    pytest.importorskip("pymongo")
    from robot_memory_tests.mongo_server import MongoServer

    with MongoServer() as server:
        yield server


@pytest.fixture(params=KINDS)
def store(request: pytest.FixtureRequest, clock: VirtualClock) -> Iterator[Store]:
    if request.param == "embedded":
        store: Store = EmbeddedStore(clock)
    elif request.param == "split":
        store = SplitStore(EmbeddedStore(clock), EmbeddedStore(clock), ["robmem_coordination"])
    else:
        pytest.importorskip("pymongo")
        from cxbridge_robot_memory.mongodb.store import MongoStore

        store = MongoStore(REAL if request.param == "mongodb" else request.getfixturevalue("server").uri)
        for collection in ("robmem.test", "robmem.other"):
            store.remove(collection, {})
    yield store
    store.close()
