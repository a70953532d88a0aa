"""STRIPS tasks, the simplest form of planning problems, which pyperplan's searches solve.

A task has numbered facts, and operators: ground actions with facts that they require, add and delete.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.compile.conditions import Fact


@dataclass(frozen=True, slots=True)
class Operator:
    """A variant of a ground action, or an auxiliary step. An operator deletes facts before it adds facts.

    :param action: the ground action; None for an auxiliary operator that only reaches the goal.
    :param preconditions: the numbers of the required facts.
    """

    action: PlannedAction | None
    preconditions: frozenset[int]
    adds: frozenset[int]
    deletes: frozenset[int]


@dataclass(frozen=True, slots=True)
class StripsTask:
    """A planning task.

    :param facts: the facts by number. A fact with the predicate ``not NAME`` means that the fact ``NAME`` is
        false.
    :param initial: the numbers of the facts of the initial state.
    :param goal: the numbers of the required facts.
    """

    facts: tuple[Fact, ...]
    initial: frozenset[int]
    goal: frozenset[int]
    operators: tuple[Operator, ...]


def remove_irrelevant_parts(task: StripsTask) -> StripsTask:
    """Return the task without operators, effects and initial facts that cannot contribute to the goal."""
    # a search backwards from the goal: if an operator adds a relevant fact, its preconditions are relevant
    achievers_by_fact: dict[int, list[Operator]] = {}
    for operator in task.operators:
        for fact_number in operator.adds:
            achievers_by_fact.setdefault(fact_number, []).append(operator)
    relevant_facts: set[int] = set()  # by number
    queue = list(task.goal)
    while queue:
        fact_number = queue.pop()
        if fact_number not in relevant_facts:
            relevant_facts.add(fact_number)
            for operator in achievers_by_fact.get(fact_number, ()):
                queue += operator.preconditions - relevant_facts
    operators = tuple(
        replace(operator, adds=operator.adds & relevant_facts, deletes=operator.deletes & relevant_facts)
        for operator in task.operators
        if operator.adds & relevant_facts
    )
    return replace(task, initial=task.initial & relevant_facts, operators=operators)
