"""The contracts of all blackboards, and the test classes of a transport."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager
from dataclasses import dataclass
from pathlib import Path

import pytest

from tests.blackboard.contract import BoardPair, Contract
from tests.blackboard.contract.data import DataContract
from tests.blackboard.contract.events import EventsContract, RegistrationContract
from tests.blackboard.contract.messages import MessagesContract
from tests.blackboard.contract.observers import ObserversContract
from tests.blackboard.contract.opening import OpeningContract

CONTRACTS: tuple[type[Contract], ...] = (
    OpeningContract,
    DataContract,
    MessagesContract,
    RegistrationContract,
    EventsContract,
    ObserversContract,
)


@dataclass(frozen=True)
class ContractEntry:
    """A transport whose blackboards the contracts test.

    :param name: the start of the names of the test classes.
    :param pairs: makes a pair of boards in a folder.
    :param contracts: the contracts; derived classes express the limits of a wire.
    :param fixtures: a class with fixtures that replace those of the contracts.
    """

    name: str
    pairs: Callable[[Path], AbstractContextManager[BoardPair]]
    contracts: tuple[type[Contract], ...] = CONTRACTS
    fixtures: type = object


def contract_tests(*entries: ContractEntry) -> dict[str, type]:
    """Return the test classes of entries by name, for the globals of a module."""
    classes = {}
    for entry in entries:
        for contract in entry.contracts:
            name = f"Test{entry.name}{contract.__name__.removeprefix('Wire').removesuffix('Contract')}"
            bases = tuple(
                base for base in (_with_pair(entry), entry.fixtures, contract) if base is not object
            )
            classes[name] = type(name, bases, {})
    return classes


def _with_pair(entry: ContractEntry) -> type:
    class WithPair:
        @pytest.fixture
        def pair(self, tmp_path: Path) -> Iterator[BoardPair]:
            with entry.pairs(tmp_path) as pair:
                yield pair

    return WithPair
