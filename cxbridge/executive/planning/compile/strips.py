"""Tasks in STRIPS: numbered facts, operators with positive preconditions; what simple planners understand."""

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
    """A way to do an action; deletes come before adds.

    :param action: None for steps that stand for nothing: they only say that a goal is reached.
    """

    action: GroundAction | None
    preconditions: frozenset[int]
    adds: frozenset[int]
    deletes: frozenset[int]


@dataclass(frozen=True, slots=True)
class StripsTask:
    """A task.

    :param facts: the meanings of the numbers; facts that stand for the falsehood of another are named ``not
        NAME``.
    :param initial: what holds at the start.
    :param goal: the facts that must hold at the end.
    """

    facts: tuple[Fact, ...]
    initial: frozenset[int]
    goal: frozenset[int]
    operators: tuple[Operator, ...]


def without_irrelevant(task: StripsTask) -> StripsTask:
    """Return the task without useless operators, and without effects that no condition needs."""
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
