"""STRIPS tasks: numbered facts, and operators with positive preconditions."""

from __future__ import annotations

from dataclasses import dataclass

from cxbridge.executive.planning.compile.conditions import Fact
from cxbridge.executive.planning.planner import PlannedAction


@dataclass(frozen=True, slots=True)
class Operator:
    """A variant of a ground action. Deletions precede additions.

    :param action: the ground action; None for an auxiliary operator that only reaches the goal.
    """

    action: PlannedAction | None
    preconditions: frozenset[int]
    adds: frozenset[int]
    deletes: frozenset[int]


@dataclass(frozen=True, slots=True)
class StripsTask:
    """A planning task.

    :param facts: the facts by number; the falsehood of a fact is named ``not NAME``.
    :param initial: the facts of the initial state.
    :param goal: the required facts.
    """

    facts: tuple[Fact, ...]
    initial: frozenset[int]
    goal: frozenset[int]
    operators: tuple[Operator, ...]


def without_irrelevant(task: StripsTask) -> StripsTask:
    """Return the task without operators and effects that cannot contribute to the goal."""
    # backwards from the goal: preconditions of operators that add a relevant fact are relevant
    achievers: dict[int, list[Operator]] = {}
    for operator in task.operators:
        for fact in operator.adds:
            achievers.setdefault(fact, []).append(operator)
    relevant: set[int] = set()
    queue = list(task.goal)
    while queue:
        fact = queue.pop()
        if fact not in relevant:
            relevant.add(fact)
            for operator in achievers.get(fact, ()):
                queue += operator.preconditions - relevant
    operators = (
        Operator(
            operator.action, operator.preconditions, operator.adds & relevant, operator.deletes & relevant
        )
        for operator in task.operators
        if operator.adds & relevant
    )
    return StripsTask(task.facts, task.initial & relevant, task.goal, tuple(operators))
