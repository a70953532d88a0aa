"""The contracts of all blackboards over Fawkes' protocol, with a remote reader, writer or both."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

from fawkes_tests.network.differences import (
    WireDataContract,
    WireEventsContract,
    WireMessagesContract,
    WireOpeningContract,
)
from fawkes_tests.network.pairs import SettledInstances, make_pair
from tests.blackboard.contract import BoardPair
from tests.blackboard.contract.events import RegistrationContract
from tests.blackboard.contract.observers import ObserversContract
from tests.blackboard.contract.suite import ContractEntry, contract_tests


def fawkes_pairs(near: bool, far: bool) -> Callable[[Path], AbstractContextManager[BoardPair]]:
    """Return pairs of two clients of a server, or of a client and the served board."""

    @contextmanager
    def pairs(_: Path) -> Iterator[BoardPair]:
        with ExitStack() as stack:
            yield make_pair(stack, near_is_remote=near, far_is_remote=far)

    return pairs


WIRE = (WireDataContract, WireMessagesContract, RegistrationContract, WireEventsContract)
ENTRIES = (
    ContractEntry(
        "Fawkes", fawkes_pairs(True, True), (WireOpeningContract, *WIRE, ObserversContract), SettledInstances
    ),
    ContractEntry("FawkesRemoteReader", fawkes_pairs(True, False), WIRE, SettledInstances),
    ContractEntry("FawkesRemoteWriter", fawkes_pairs(False, True), WIRE, SettledInstances),
)
globals().update(contract_tests(*ENTRIES))
