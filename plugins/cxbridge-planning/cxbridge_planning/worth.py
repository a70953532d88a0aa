"""The worth of a plan: the value of its metric."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.executive.pddl import Problem
from cxbridge.executive.pddl.ast import TOTAL_TIME
from cxbridge.executive.problem.truth import KnownState
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.validation.plan import PlanCheck


def metric_value(problem: Problem, actions: Iterable[PlannedAction], check: PlanCheck) -> float | None:
    """Return the value of a problem's metric after a plan; None without a metric or a value.

    A plan without times takes one time unit per step.
    """
    if problem.metric is None:
        return None
    steps = tuple(actions)
    ends = [step.start + (step.duration or 0.0) for step in steps if step.start is not None]
    total_time = max(ends) if ends else float(len(steps))
    numbers = {**check.end.numbers, (TOTAL_TIME, ()): total_time}
    return KnownState((), numbers, lambda _types: ()).number(problem.metric[1], {})
