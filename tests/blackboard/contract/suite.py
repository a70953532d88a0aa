"""The contract of all blackboards as one list of classes, made into tests for a transport by one entry."""

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
    """A transport that is held to the contract.

    :param name: begins the names of its tests' classes.
    :param pairs: makes two ways to the same interfaces, given a folder.
    :param contracts: those that it keeps; a transport derives from one where its wire cannot carry something.
    :param fixtures: a class with fixtures that take the place of the contracts'.
    """

    name: str
    pairs: Callable[[Path], AbstractContextManager[BoardPair]]
    contracts: tuple[type[Contract], ...] = CONTRACTS
    fixtures: type = object


def contract_tests(*entries: ContractEntry) -> dict[str, type]:
    """Return the tests' classes of some entries, for a module's globals."""
    made = {}
    for entry in entries:
        for contract in entry.contracts:
            name = f"Test{entry.name}{contract.__name__.removeprefix('Wire').removesuffix('Contract')}"
            bases = tuple(one for one in (_with_pair(entry), entry.fixtures, contract) if one is not object)
            made[name] = type(name, bases, {})
    return made


def _with_pair(entry: ContractEntry) -> type:
    class WithPair:
        @pytest.fixture
        def pair(self, tmp_path: Path) -> Iterator[BoardPair]:
            with entry.pairs(tmp_path) as pair:
                yield pair

    return WithPair
