"""Names as domain and problem have them: planners may answer in upper or lower case."""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.pddl.ast import names_of
from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.planning.planner import PlannedAction


class PlanNames:
    """Finds the actions and objects that a planner means.

    :ivar durative: whether actions take time.
    """

    def __init__(self, domain: Domain, problem: Problem) -> None:
        self.durative = any(action.durative for action in domain.actions)
        self._actions = _table(action.name for action in domain.actions)
        self._objects = _table((*names_of(domain.constants), *names_of(problem.objects)))

    def step(
        self,
        action: str,
        arguments: Iterable[str],
        start: float | None = None,
        duration: float | None = None,
    ) -> PlannedAction:
        """Return the step of a plan.

        :raises PlanningError: for an unknown action or object.
        """
        found = tuple(_find(each, self._objects, "object") for each in arguments)
        return PlannedAction(_find(action, self._actions, "action"), found, start, duration)


def _table(names: Iterable[str]) -> dict[str, str]:
    """Return the names by themselves and by their case-folded form; themselves win."""
    exact = {name: name for name in names}
    return {name.casefold(): name for name in exact} | exact


def _find(name: str, table: dict[str, str], what: str) -> str:
    found = table.get(name) or table.get(name.casefold())
    if found is None:
        raise PlanningError(f"the plan names an {what} that does not exist: {name}")
    return found
