"""Reading of plans; names get the spelling of the domain and the problem, which planners may change."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.pddl.ast import names_of
from cxbridge.executive.pddl.decoding import read_text
from cxbridge.history.plan_steps import PlannedAction, parse_plan_text
from cxbridge_planning.errors import PlanningError


class PlanNames:
    """Finds the actions and objects that a plan names, regardless of upper and lower case.

    :ivar has_durative_actions: whether any action is durative.
    """

    def __init__(self, domain: Domain, problem: Problem) -> None:
        self.has_durative_actions = any(action.is_durative for action in domain.actions)
        self._action_spellings = _names_by_spelling(action.name for action in domain.actions)
        self._object_spellings = _names_by_spelling((*names_of(domain.constants), *names_of(problem.objects)))

    def make_step(
        self,
        action: str,
        arguments: Iterable[str],
        start: float | None = None,
        duration: float | None = None,
    ) -> PlannedAction:
        """Return a step of a plan.

        :param start: the start in seconds after the start of the plan; None for a step without times.
        :param duration: the duration in seconds; None for a step without duration.
        :raises PlanningError: if the action or an object is unknown.
        """
        return PlannedAction(
            _find_spelling(action, self._action_spellings, "action"),
            tuple(_find_spelling(argument, self._object_spellings, "object") for argument in arguments),
            start,
            duration,
        )


def load_plan(path: str | Path, names: PlanNames) -> tuple[PlannedAction, ...]:
    """Read a plan file, without its comments.

    :param names: the known actions and objects.
    :raises PddlError: if the file cannot be read, or is too large.
    :raises PlanningError: if a line is not a step with known names.
    """
    steps = []
    for number, line in enumerate(read_text(path, "plan").splitlines(), start=1):
        step_text = line.partition(";")[0]
        if not step_text.strip():
            continue
        try:
            (step,) = parse_plan_text(step_text)
            steps.append(names.make_step(*step))
        except (ValueError, PlanningError) as error:
            raise PlanningError(
                str(error),
                file=str(path),
                line=number,
                hint="write (NAME OBJECT ...), or START: (NAME OBJECT ...) [DURATION]",
            ) from None
    return tuple(steps)


def _names_by_spelling(names: Iterable[str]) -> dict[str, str]:
    """Return the names by exact and by case-folded spelling; an exact spelling takes precedence."""
    exact_names = {name: name for name in names}
    return {name.casefold(): name for name in exact_names} | exact_names


def _find_spelling(name: str, spellings: dict[str, str], kind: str) -> str:
    spelling = spellings.get(name) or spellings.get(name.casefold())
    if spelling is None:
        raise PlanningError(f"the plan names an {kind} that does not exist: {name}")
    return spelling
