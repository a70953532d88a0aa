"""The table of planners: pyperplan, and the planners of plug-ins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final, NamedTuple

from cxbridge.executive.pddl.ast import Domain, Problem
from cxbridge.executive.planning.errors import UnknownPlannerError, UnsupportedProblemError
from cxbridge.executive.planning.needs import needs_of
from cxbridge.executive.planning.planner import Planner
from cxbridge.extras import plugin_command
from cxbridge.plugins import PluginError, Row, Table, package_with

AUTO: Final = "auto"
"""All installed planners that accept the problem, in order until a plan is found."""

PLANNERS: Final[Table[Callable[..., Planner]]] = Table(
    "PLANNERS",
    callable,
    "a function that returns a Planner, or a class of planners",
    Row("pyperplan", "cxbridge.executive.planning.embedded:PyperplanPlanner"),
)
"""The planners. An entry is called with the planner's options as texts."""


def planner_names() -> list[str]:
    """Return the known planners, installed or not."""
    return [row.name for row in PLANNERS.rows]


def make_planner(name: str, options: Mapping[str, str] | None = None) -> Planner:
    """Return a planner by name.

    :raises UnknownPlannerError: if the planner or an option is unknown.
    """
    options = dict(options or {})
    try:
        return PLANNERS.load(PLANNERS.find(name))(**options)
    except PluginError as error:
        raise UnknownPlannerError(error.message, hint=error.hint) from None
    except TypeError:
        raise UnknownPlannerError(f"planner {name} has no options {', '.join(sorted(options))}") from None


def more_planners() -> str:
    """Return the command that installs more planners; empty if a plug-in provides some."""
    package = package_with(PLANNERS.hook)
    return plugin_command(package) if package and not any(row.origin for row in PLANNERS.rows) else ""


class Choice(NamedTuple):
    """The planners for a problem.

    :param planners: the planners in the order of the attempts.
    :param reasons: why further planners are excluded or tried late.
    :param absent: suitable planners that are not installed.
    """

    planners: tuple[Planner, ...]
    reasons: tuple[str, ...]
    absent: tuple[str, ...] = ()


def choose_planners(
    name: str, domain: Domain, problem: Problem, options: Mapping[str, str] | None = None
) -> Choice:
    """Return the named planner, or for :data:`AUTO` all suitable ones.

    :raises UnknownPlannerError: if the planner is unknown.
    :raises UnsupportedProblemError: if no planner accepts the problem, with the reasons.
    """
    needs = needs_of(domain, problem)
    if name != AUTO:
        planner = make_planner(name, options)
        planner.check(needs)
        return Choice((planner,), ())
    planners = [(planner_name, make_planner(planner_name)) for planner_name in planner_names()]
    suitable: list[tuple[int, Planner]] = []
    reasons, missing, absent = [], [], []
    for planner_name, planner in sorted(planners, key=lambda pair: pair[1].rank(needs)):
        reason = planner.refuses(needs)
        if planner.not_installed:
            missing.append(planner.not_installed)
            absent += [] if reason else [planner_name]
        elif reason:
            reasons.append(reason)
        else:
            ignored = [need for need in needs if need in planner.ignores]
            reasons += [f"{planner_name} ignores {need.value}" for need in ignored]
            suitable.append((len(ignored), planner))
    if not suitable:
        hint = f"more planners: {command}" if (command := more_planners()) else None
        message = f"no planner can take this problem: {'; '.join(reasons + missing)}"
        raise UnsupportedProblemError(message, hint=hint)
    # a planner that ignores costs comes after all that count them; both sorts are stable
    suitable.sort(key=lambda pair: pair[0])
    return Choice(tuple(planner for _, planner in suitable), tuple(reasons), tuple(absent))
