"""STRIPS tasks: numbered facts, and operators with positive preconditions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from cxbridge.executive.planning.compile.conditions import Fact


class GroundAction(NamedTuple):
    """An action with its objects."""

    name: str
    arguments: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Operator:
    """A variant of a ground action. Deletions precede additions.

    :param action: None for an auxiliary operator that only reaches the goal.
    """

    action: GroundAction | None
    preconditions: frozenset[int]
    adds: frozenset[int]
    deletes: frozenset[int]


@dataclass(frozen=True, slots=True)
class StripsTask:
    """A planning task.

    :param facts: facts by number; the falsehood of a fact is named ``not NAME``.
    :param initial: the facts of the initial state.
    :param goal: the required facts.
    """

    facts: tuple[Fact, ...]
    initial: frozenset[int]
    goal: frozenset[int]
    operators: tuple[Operator, ...]


def without_irrelevant(task: StripsTask) -> StripsTask:
    """Return the task without useless operators and effects."""
    adding: dict[int, list[Operator]] = {}
    for operator in task.operators:
        for fact in operator.adds:
            adding.setdefault(fact, []).append(operator)
    relevant: set[int] = set()
    queue = list(task.goal)
    while queue:
        fact = queue.pop()
        if fact not in relevant:
            relevant.add(fact)
            for operator in adding.get(fact, ()):
                queue += operator.preconditions - relevant
    wanted = frozenset(relevant)
    operators = (
        Operator(each.action, each.preconditions, each.adds & wanted, each.deletes & wanted)
        for each in task.operators
        if each.adds & wanted
    )
    return StripsTask(task.facts, task.initial & wanted, task.goal, tuple(operators))
