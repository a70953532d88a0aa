"""Plans as planners write them; names get the letters that domain and problem have."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.pddl.ast import names_of
from cxbridge.executive.pddl.decoding import read_text
from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.planning.plan_text import parse_plan_text
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


def load_plan(path: str | Path, names: PlanNames) -> tuple[PlannedAction, ...]:
    """Read a plan from a file, with comments, in upper or lower case.

    :param names: finds the actions and objects that are meant.
    :raises PlanningError: when the file cannot be read, or a line has no step.
    """
    steps = []
    for number, line in enumerate(read_text(path, "plan").splitlines(), start=1):
        text = line.partition(";")[0]
        if not text.strip():
            continue
        try:
            (step,) = parse_plan_text(text)
            steps.append(names.step(*step))
        except (ValueError, PlanningError) as error:
            hint = "write (NAME OBJECT ...), or START: (NAME OBJECT ...) [DURATION]"
            raise PlanningError(str(error), file=str(path), line=number, hint=hint) from None
    return tuple(steps)


def _table(names: Iterable[str]) -> dict[str, str]:
    """Return the names by themselves and by their case-folded form; themselves win."""
    exact = {name: name for name in names}
    return {name.casefold(): name for name in exact} | exact


def _find(name: str, table: dict[str, str], kind: str) -> str:
    found = table.get(name) or table.get(name.casefold())
    if found is None:
        raise PlanningError(f"the plan names an {kind} that does not exist: {name}")
    return found
