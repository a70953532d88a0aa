"""The contract of all blackboards: one entry a transport, more where it depends on which end is remote."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.clock import VirtualClock
from cxbridge.events import EventBus
from tests.blackboard.contract import BoardPair
from tests.blackboard.contract.events import CallersThreadContract
from tests.blackboard.contract.suite import CONTRACTS, ContractEntry, contract_tests
from tests.blackboard.samples import SampleRegistry
from tests.blackboard.zmq.support import bench
from tests.blackboard.zmq.threads import watched_sockets


@contextmanager
def local_pair(_: Path) -> Iterator[BoardPair]:
    """Twice the same board."""
    clock = VirtualClock()
    bus = EventBus(clock)
    board = LocalBlackBoard(SampleRegistry(), clock, bus)
    yield BoardPair(near=board, far=board, clock=clock, bus=bus)


def zmq_pairs(transport: str) -> Callable[[Path], AbstractContextManager[BoardPair]]:
    """Two clients of a server; two threads in one of their sockets are found."""

    @contextmanager
    def pairs(folder: Path) -> Iterator[BoardPair]:
        with watched_sockets(), bench(transport, folder) as made:
            near, far = made.client(name="near"), made.client(name="far")
            yield BoardPair(near=near, far=far, clock=made.clock, bus=made.bus, settle=made.settle)

    return pairs


ENTRIES = (
    ContractEntry("Local", local_pair, (*CONTRACTS, CallersThreadContract)),
    ContractEntry("ZmqIpc", zmq_pairs("ipc")),
    ContractEntry("ZmqTcp", zmq_pairs("tcp")),
)
globals().update(contract_tests(*ENTRIES))
