"""Planners by name: pyperplan, and the rows of plug-ins."""

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
"""All planners that are installed and can take the problem, one after the other until there is a plan."""

PLANNERS: Final[Table[Callable[..., Planner]]] = Table(
    "PLANNERS",
    callable,
    "a function that returns a Planner, or a class of planners",
    Row("pyperplan", "cxbridge.executive.planning.embedded:PyperplanPlanner"),
)
"""The planners; an object is called with the options of its planner, which are texts."""


def planner_names() -> list[str]:
    """Return the names of the known planners, installed or not."""
    return [row.name for row in PLANNERS.rows]


def make_planner(name: str, options: Mapping[str, str] | None = None) -> Planner:
    """Return the planner of a name.

    :raises UnknownPlannerError: when no planner has the name, or the planner has no such option.
    """
    given = dict(options or {})
    try:
        return PLANNERS.load(PLANNERS.find(name))(**given)
    except PluginError as error:
        raise UnknownPlannerError(error.message, hint=error.hint) from None
    except TypeError:
        raise UnknownPlannerError(f"planner {name} has no options {', '.join(sorted(given))}") from None


def more_planners() -> str:
    """Return the command that installs more planners; empty when a plug-in with planners is installed."""
    package = package_with(PLANNERS.hook)
    return plugin_command(package) if package and not any(row.origin for row in PLANNERS.rows) else ""


class Choice(NamedTuple):
    """The planners for a problem.

    :param planners: in the order in which they are tried.
    :param reasons: why further planners are not among them, or why one comes late.
    :param absent: the names of those that could take the problem and are not installed.
    """

    planners: tuple[Planner, ...]
    reasons: tuple[str, ...]
    absent: tuple[str, ...] = ()


def choose_planners(
    name: str, domain: Domain, problem: Problem, options: Mapping[str, str] | None = None
) -> Choice:
    """Return the planner of a name, or for :data:`AUTO` all that can take the problem.

    :raises UnknownPlannerError: when no planner has the name.
    :raises UnsupportedProblemError: when no planner can take this problem, with the reasons.
    """
    needs = needs_of(domain, problem)
    if name != AUTO:
        planner = make_planner(name, options)
        planner.check(needs)
        return Choice((planner,), ())
    known = [(make_planner(each), each) for each in planner_names()]
    known.sort(key=lambda pair: pair[0].rank(needs))
    fitting: list[tuple[int, Planner]] = []
    reasons, missing, absent = [], [], []
    for planner, each in known:
        reason = planner.refuses(needs)
        if planner.not_installed:
            missing.append(planner.not_installed)
            absent += [] if reason else [each]
            continue
        if reason:
            reasons.append(reason)
            continue
        left_out = [need for need in needs if need in planner.ignores]
        reasons += [f"{each} ignores {need.value}" for need in left_out]
        fitting.append((len(left_out), planner))
    if not fitting:
        hint = f"more planners: {more}" if (more := more_planners()) else None
        message = f"no planner can take this problem: {'; '.join(reasons + missing)}"
        raise UnsupportedProblemError(message, hint=hint)
    fitting.sort(key=lambda pair: pair[0])  # the sort is stable: the order among equals stays
    return Choice(tuple(planner for _, planner in fitting), tuple(reasons), tuple(absent))
