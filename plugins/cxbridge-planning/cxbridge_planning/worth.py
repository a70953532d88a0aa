"""Why a step of a plan is there: the conditions and the goal that need its effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from cxbridge.executive.planning.validation.plan import PlanCheck
from cxbridge.executive.problem.truth import Ground

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
