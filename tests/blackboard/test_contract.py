"""The contract of all blackboards, for the transports of the core."""

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
    """Yield a pair with the same local board twice."""
    clock = VirtualClock()
    bus = EventBus(clock)
    board = LocalBlackBoard(SampleRegistry(), clock, bus)
    yield BoardPair(near=board, far=board, clock=clock, bus=bus)


def zmq_pairs(transport: str) -> Callable[[Path], AbstractContextManager[BoardPair]]:
    """Return the pairs of two clients of a server, with a check for sockets in two threads."""

    @contextmanager
    def pairs(folder: Path) -> Iterator[BoardPair]:
        with watched_sockets(), bench(transport, folder) as served:
            near, far = served.client(name="near"), served.client(name="far")
            yield BoardPair(near=near, far=far, clock=served.clock, bus=served.bus, settle=served.settle)

    return pairs


ENTRIES = (
    ContractEntry("Local", local_pair, (*CONTRACTS, CallersThreadContract)),
    ContractEntry("ZmqIpc", zmq_pairs("ipc")),
    ContractEntry("ZmqTcp", zmq_pairs("tcp")),
)
globals().update(contract_tests(*ENTRIES))
