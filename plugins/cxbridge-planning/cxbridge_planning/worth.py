"""The worth of a plan: the value of its metric, and the services of its steps.

A service is a fact that a step makes true and that another step, or the goal, needs.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from cxbridge.executive.pddl import Problem
from cxbridge.executive.pddl.ast import TOTAL_TIME, Ground
from cxbridge.executive.planning.planner import PlannedAction
from cxbridge.executive.planning.validation.plan import PlanCheck
from cxbridge.executive.problem.truth import KnownState

GOAL = 0
"""The number of the goal among the steps, which count from 1."""


@dataclass(frozen=True, slots=True)
class Service:
    """A fact that one step makes true for another step or for the goal.

    :param step: the step that needs the fact, or :data:`GOAL`.
    """

    fact: Ground
    step: int


def find_services(check: PlanCheck) -> Mapping[int, Sequence[Service]]:
    """Return the services of the steps of a plan by number; a step without services is useless."""
    services_of_steps: dict[int, list[Service]] = {}
    producers: dict[Ground, int] = {}
    for moment in check.moments:
        _add_services(services_of_steps, producers, moment.needs, moment.step)
        for fact in moment.changes.deletes:
            producers.pop(fact, None)
        producers |= dict.fromkeys(moment.changes.adds, moment.step)
    _add_services(services_of_steps, producers, check.goal_needs, GOAL)
    return services_of_steps


def _add_services(
    services_of_steps: dict[int, list[Service]],
    producers: Mapping[Ground, int],
    needs: frozenset[Ground],
    step: int,
) -> None:
    """Add the needs of a step to the services of the steps that make the needed facts true."""
    for fact in sorted(needs):
        producer = producers.get(fact)
        if producer is not None and producer != step:
            services_of_steps.setdefault(producer, []).append(Service(fact, step))


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
