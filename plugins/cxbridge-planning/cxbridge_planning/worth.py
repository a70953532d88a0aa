"""The worth of a plan: the value of its metric, and for each step the conditions that need its effects."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cxbridge.executive.pddl import Problem
from cxbridge.executive.pddl.ast import Ground
from cxbridge.executive.planning.needs import TOTAL_TIME
from cxbridge.executive.planning.planner import PlannedAction
from cxbridge.executive.planning.validation.plan import PlanCheck
from cxbridge.executive.problem.truth import KnownState

GOAL = 0
"""The number that stands for the goal among the steps."""


@dataclass(frozen=True, slots=True)
class Service:
    """A fact that one step makes true and another one, or the goal, needs.

    :param step: the step that needs it; :data:`GOAL`.
    """

    fact: Ground
    step: int


def services(check: PlanCheck) -> Mapping[int, Sequence[Service]]:
    """Return what each step of a plan serves, by its number. A step that serves nothing is not needed."""
    found: dict[int, list[Service]] = {}
    last: dict[Ground, int] = {}
    for moment in check.moments:
        _serve(found, last, moment.needs, moment.step)
        for fact in moment.changes.deletes:
            last.pop(fact, None)
        last |= dict.fromkeys(moment.changes.adds, moment.step)
    _serve(found, last, check.goal_needs, GOAL)
    return found


def _serve(
    found: dict[int, list[Service]], last: Mapping[Ground, int], needs: frozenset[Ground], step: int
) -> None:
    for fact in sorted(needs):
        maker = last.get(fact)
        if maker is not None and maker != step:
            found.setdefault(maker, []).append(Service(fact, step))


def value_of_metric(problem: Problem, actions: Iterable[PlannedAction], check: PlanCheck) -> float | None:
    """Return the value of a problem's metric after a plan; None when there is none, or no value.

    A plan that is just an order takes as much time as it has steps.
    """
    if problem.metric is None:
        return None
    steps = tuple(actions)
    ends = [step.start + (step.duration or 0.0) for step in steps if step.start is not None]
    took = max(ends) if ends else float(len(steps))
    numbers = {**check.end.numbers, (TOTAL_TIME, ()): took}
    return KnownState((), numbers, lambda _types: ()).number(problem.metric[1], {})
