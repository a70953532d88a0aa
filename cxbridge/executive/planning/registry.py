"""Planners by name."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Final, NamedTuple

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.planning.engines.command import CommandPlanner
from cxbridge.executive.planning.engines.embedded import PyperplanPlanner
from cxbridge.executive.planning.engines.needs import Need, needs_of
from cxbridge.executive.planning.engines.programs import PROGRAMS
from cxbridge.executive.planning.engines.unified import ENGINES, UnifiedPlanner
from cxbridge.executive.planning.errors import UnknownPlannerError, UnsupportedProblemError
from cxbridge.executive.planning.planner import Planner

AUTO: Final = "auto"
"""All planners that are installed and can take the problem, one after the other until there is a plan."""

_CLASSICAL: Final = ("fast-downward", "pyperplan", "lpg", "enhsp", "fd", "ff", "aries", "tamer")
_NUMERIC: Final = ("enhsp", "lpg", "tamer", "aries")
_TEMPORAL: Final = ("lpg", "aries", "tamer", "optic", "popf")

NAMES: Final = ("pyperplan", *ENGINES, *PROGRAMS)


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
        if name in PROGRAMS:
            return CommandPlanner(name, **given)
    except TypeError:
        raise UnknownPlannerError(f"planner {name} has no options {', '.join(sorted(given))}") from None
    raise UnknownPlannerError(
        f"there is no planner '{name}'", hint=f"take one of {', '.join((AUTO, *NAMES))}"
    )


class Choice(NamedTuple):
    """The planners for a problem.

    :param planners: in the order in which they are tried.
    :param reasons: why the others are not among them, or why one comes late.
    :param absent: the names of those that could take the problem and are not installed.
    """

    planners: tuple[Planner, ...]
    reasons: tuple[str, ...]
    absent: tuple[str, ...] = ()


def choose_planners(
    name: str, domain: Domain, problem: Problem, options: Mapping[str, str] | None = None
) -> Choice:
    """Return the planner of a name, or for :data:`AUTO` all that can take the problem.

    :raises UnknownPlannerError: when there is none of that name.
    :raises UnsupportedProblemError: when none can take this problem, with the reasons.
    """
    if name != AUTO:
        planner = make_planner(name, options)
        planner.check(domain, problem)
        return Choice((planner,), ())
    fitting: list[tuple[int, Planner]] = []
    reasons, absent, names = [], [], []
    for each in _order(needs_of(domain, problem)):
        planner = make_planner(each)
        if planner.not_installed:
            absent.append(planner.not_installed)
        reason = planner.refuses(domain, problem)
        if planner.not_installed:
            names += [] if reason else [each]
            continue
        if reason:
            reasons.append(reason)
            continue
        left_out = planner.left_out(domain, problem)
        reasons += [f"{each} ignores {need.value}" for need in left_out]
        fitting.append((len(left_out), planner))
    if not fitting:
        raise UnsupportedProblemError(f"no planner can take this problem: {'; '.join(reasons + absent)}")
    fitting.sort(key=lambda pair: pair[0])  # it is stable: the order among equals stays
    return Choice(tuple(planner for _, planner in fitting), tuple(reasons), tuple(names))


def _order(needs: Collection[Need]) -> tuple[str, ...]:
    """Return the planners in the order of measured success (docs/planning.md)."""
    first: tuple[str, ...]
    if Need.TIME in needs:
        first = _TEMPORAL
    elif Need.NUMBERS in needs:
        first = _NUMERIC
    else:
        first = _CLASSICAL
    return (*first, *(name for name in NAMES if name not in first))
