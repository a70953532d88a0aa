"""The states of facts and numbers during a plan, their changes, and the reads of conditions."""

from __future__ import annotations

from collections.abc import Container, Iterator, Mapping
from dataclasses import dataclass, field

from cxbridge.executive.pddl.ast import Ground, Problem, make_ground


@dataclass(frozen=True, slots=True)
class WorldState:
    """Facts and function values."""

    facts: frozenset[Ground]
    numbers: Mapping[Ground, float]

    @classmethod
    def from_problem(cls, problem: Problem) -> WorldState:
        """Return the initial state of a problem."""
        return cls(
            frozenset(make_ground(atom.predicate, atom) for atom in problem.init),
            {make_ground(term.function, term): value for term, value in problem.numbers},
        )

    def after(self, changes: Changes) -> WorldState:
        """Return the state after changes. Deletions precede additions."""
        facts = (self.facts - changes.deletes) | changes.adds
        return WorldState(facts, {**self.numbers, **changes.numbers})


@dataclass(frozen=True, slots=True)
class Changes:
    """The facts and numbers that a happening of a plan changes.

    A happening is an action without duration, or the start or the end of a durative action.
    """

    adds: set[Ground] = field(default_factory=set)
    deletes: set[Ground] = field(default_factory=set)
    numbers: dict[Ground, float] = field(default_factory=dict)

    @property
    def written(self) -> set[Ground]:
        """The changed facts and functions."""
        return self.adds | self.deletes | self.numbers.keys()


class RecordingFacts(Container[Ground]):
    """The facts of a state. Records the facts that a condition reads.

    :ivar true_reads: the facts that were read as true.
    :ivar false_reads: the facts that were read as false.
    """

    def __init__(self, facts: Container[Ground]) -> None:
        self._facts = facts
        self.true_reads: set[Ground] = set()
        self.false_reads: set[Ground] = set()

    def __contains__(self, fact: object) -> bool:
        assert isinstance(fact, tuple)
        is_true = fact in self._facts
        (self.true_reads if is_true else self.false_reads).add(fact)
        return is_true


class RecordingNumbers(Mapping[Ground, float]):
    """The function values of a state. Records the functions that a condition reads.

    :ivar reads: the functions that were read.
    """

    def __init__(self, numbers: Mapping[Ground, float]) -> None:
        self._numbers = numbers
        self.reads: set[Ground] = set()

    def __getitem__(self, key: Ground) -> float:
        self.reads.add(key)
        return self._numbers[key]

    def __iter__(self) -> Iterator[Ground]:
        return iter(self._numbers)

    def __len__(self) -> int:
        return len(self._numbers)
