"""Planners by name."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.planning.engines.command import COMMANDS, CommandPlanner
from cxbridge.executive.planning.engines.embedded import PyperplanPlanner
from cxbridge.executive.planning.engines.unified import ENGINES, UnifiedPlanner
from cxbridge.executive.planning.errors import UnknownPlannerError, UnsupportedProblemError
from cxbridge.executive.planning.planner import Planner

AUTO: Final = "auto"
"""The first planner that is installed and understands the problem."""

NAMES: Final = ("pyperplan", *ENGINES, *COMMANDS)


def make_planner(name: str, options: Mapping[str, str] | None = None) -> Planner:
    """Return the planner of a name.

    :param options: pyperplan: ``search`` and ``heuristic``; programs: ``options``, as on a command line,
        and ``program``.
    :raises UnknownPlannerError: when there is none of that name, or it has no such option.
    """
    given = dict(options or {})
    try:
        if name == "pyperplan":
            return PyperplanPlanner(**given)
        if name in ENGINES:
            return UnifiedPlanner(name, **given)
        if name in COMMANDS:
            return CommandPlanner(name, **given)
    except TypeError:
        raise UnknownPlannerError(f"planner {name} has no options {', '.join(sorted(given))}") from None
    raise UnknownPlannerError(
        f"there is no planner '{name}'", hint=f"take one of {', '.join((AUTO, *NAMES))}"
    )


def choose_planner(
    name: str, domain: Domain, problem: Problem, options: Mapping[str, str] | None = None
) -> Planner:
    """Return the planner of a name, or for :data:`AUTO` the first that can take the problem.

    :raises UnknownPlannerError: when there is none of that name.
    :raises UnsupportedProblemError: when it cannot take this problem, with the reason.
    """
    if name != AUTO:
        planner = make_planner(name, options)
        planner.check(domain, problem)
        return planner
    reasons = []
    for each in NAMES:
        planner = make_planner(each)
        reason = planner.not_installed or planner.refuses(domain, problem)
        if not reason:
            return planner
        reasons.append(reason)
    raise UnsupportedProblemError(f"no planner can take this problem: {'; '.join(reasons)}")
