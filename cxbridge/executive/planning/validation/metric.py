"""What a plan is worth by its problem's metric."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.executive.pddl import Problem
from cxbridge.executive.planning.engines.needs import TOTAL_TIME
from cxbridge.executive.planning.planner import PlannedAction
from cxbridge.executive.planning.validation.plan import PlanCheck
from cxbridge.executive.problem.truth import Truth


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
    return Truth((), numbers, lambda _types: ()).number(problem.metric[1], {})
