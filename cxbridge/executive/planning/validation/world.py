"""World states, their reads and changes."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, field

from cxbridge.executive.pddl.ast import Atom, Constant, Domain, FunctionTerm, Ground, Problem
from cxbridge.executive.pddl.types import ObjectTable


def ground_of(name: str, term: Atom | FunctionTerm) -> Ground:
    """Return the ground form of an atom or function term."""
    return name, tuple(argument.name for argument in term.arguments if isinstance(argument, Constant))


@dataclass(frozen=True, slots=True)
class WorldState:
    """Facts and function values."""

    facts: frozenset[Ground]
    numbers: Mapping[Ground, float]

    @classmethod
    def of_problem(cls, problem: Problem) -> WorldState:
        """Return the initial state of a problem."""
        return cls(
            frozenset(ground_of(atom.predicate, atom) for atom in problem.init),
            {ground_of(call.function, call): value for call, value in problem.numbers},
        )

    def after(self, changes: Changes) -> WorldState:
        """Return the state after changes. Deletions precede additions."""
        if not changes:
            return self
        numbers = {**self.numbers, **changes.numbers} if changes.numbers else self.numbers
        return WorldState((self.facts - changes.deletes) | changes.adds, numbers)


@dataclass(frozen=True, slots=True)
class Changes:
    """The changes of a state at one moment."""

    adds: set[Ground] = field(default_factory=set)
    deletes: set[Ground] = field(default_factory=set)
    numbers: dict[Ground, float] = field(default_factory=dict)

    def __bool__(self) -> bool:
        return bool(self.adds or self.deletes or self.numbers)

    @property
    def written(self) -> set[Ground]:
        """The changed facts and functions."""
        return self.adds | self.deletes | self.numbers.keys()


class FactsRead(Collection[Ground]):
    """Facts that record the queried ones."""

    def __init__(self, facts: Collection[Ground]) -> None:
        self._facts = facts
        self.true: set[Ground] = set()
        self.false: set[Ground] = set()

    def __contains__(self, item: object) -> bool:
        found = item in self._facts
        assert isinstance(item, tuple)
        (self.true if found else self.false).add(item)
        return found

    def __iter__(self) -> Iterator[Ground]:
        return iter(self._facts)

    def __len__(self) -> int:
        return len(self._facts)


class NumbersRead(Mapping[Ground, float]):
    """Function values that record the queried ones."""

    def __init__(self, numbers: Mapping[Ground, float]) -> None:
        self._numbers = numbers
        self.read: set[Ground] = set()

    def __getitem__(self, key: Ground) -> float:
        self.read.add(key)
        return self._numbers[key]

    def __iter__(self) -> Iterator[Ground]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)


class Objects:
    """The objects of a problem by type, for formulas."""

    def __init__(self, domain: Domain, problem: Problem) -> None:
        self._table = ObjectTable(domain, problem)

    def of(self, types: tuple[str, ...]) -> Collection[str]:
        """Return the objects of some types; without types all objects."""
        return self._table.of(types).keys()
