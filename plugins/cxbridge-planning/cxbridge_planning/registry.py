"""The table of planners, and the choice of planners for a problem."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.plugins import PluginError, Table
from cxbridge_planning.errors import UnknownPlannerError, UnsupportedProblemError
from cxbridge_planning.needs import problem_needs
from cxbridge_planning.planner import Planner

AUTO: Final = "auto"
"""The name that stands for all installed planners that accept the problem, tried in order."""

PLANNERS: Final[Table[Callable[..., Planner]]] = Table(
    "PLANNERS",
    callable,
    "a function that returns a Planner, or a class of planners",
)
"""The planners by name. The loaded object is called with the planner's options as keyword arguments."""


def planner_names() -> list[str]:
    """Return the known planners, installed or not."""
    return [row.name for row in PLANNERS.rows]


def make_planner(name: str, options: Mapping[str, str] | None = None) -> Planner:
    """Return a planner by name.

    :raises UnknownPlannerError: if the planner or an option is unknown, or the value of an option is invalid.
    """
    options = dict(options or {})
    try:
        return PLANNERS.load_target(PLANNERS.find(name))(**options)
    except PluginError as error:
        raise UnknownPlannerError(error.message, hint=error.hint) from None
    except TypeError:
        raise UnknownPlannerError(
            f"planner {name} {'lacks at least one of the' if len(options) > 1 else 'has no'} options "
            f"{', '.join(sorted(options))}"
        ) from None


class PlannerChoice(NamedTuple):
    """The planners for a problem.

    :param planners: the planners in the order of the attempts.
    :param reasons: why other planners are excluded, or tried late.
    :param unavailable_names: the names of suitable planners that are not installed.
    """

    planners: tuple[Planner, ...]
    reasons: tuple[str, ...]
    unavailable_names: tuple[str, ...] = ()


def choose_planners(
    name: str, domain: Domain, problem: Problem, options: Mapping[str, str] | None = None
) -> PlannerChoice:
    """Return the named planner, or for :data:`AUTO` all suitable planners.

    :param options: the options of the named planner; :data:`AUTO` ignores them.
    :raises UnknownPlannerError: if the planner or an option is unknown, or the value of an option is invalid.
    :raises UnsupportedProblemError: if no planner accepts the problem, with the reasons.
    """
    needs = problem_needs(domain, problem)
    if name != AUTO:
        planner = make_planner(name, options)
        planner.check(needs)
        return PlannerChoice((planner,), ())
    named_planners = [(planner_name, make_planner(planner_name)) for planner_name in planner_names()]
    suitable_planners: list[tuple[int, Planner]] = []  # each with the number of needs that it ignores
    reasons, missing_texts, unavailable_names = [], [], []
    for planner_name, planner in sorted(
        named_planners, key=lambda named_planner: named_planner[1].rank(needs)
    ):
        reason = planner.refusal_reason(needs)
        if planner.unavailable_reason:
            missing_texts.append(planner.unavailable_reason)
            unavailable_names += [] if reason else [planner_name]
        elif reason:
            reasons.append(reason)
        else:
            ignored_needs = [need for need in needs if need in planner.ignores]
            reasons += [f"{planner_name} ignores {need.value}" for need in ignored_needs]
            suitable_planners.append((len(ignored_needs), planner))
    if not suitable_planners:
        reason = "; ".join(reasons + missing_texts)
        raise UnsupportedProblemError(f"no planner supports this problem: {reason}")
    # planners that ignore more needs, e.g. costs, come later; the sort is stable: the ranks decide among
    # planners that ignore equally many
    suitable_planners.sort(key=lambda counted_planner: counted_planner[0])
    return PlannerChoice(
        tuple(planner for _, planner in suitable_planners), tuple(reasons), tuple(unavailable_names)
    )
