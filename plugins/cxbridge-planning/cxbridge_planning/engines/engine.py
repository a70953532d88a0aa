"""The base of planners with engines: supported PDDL features, rank, time for better plans.

An engine is an external program, or an engine of the library unified-planning.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.errors import PlanningError, UnknownPlannerError
from cxbridge_planning.needs import Need
from cxbridge_planning.plan_files import PlanNames
from cxbridge_planning.planner import DEFAULT_RANK, Planner

# The engines by kind of problem, in the order of their measured success (docs/planning.md).
_BEST_CLASSICAL: Final = ("fast-downward",)
_CLASSICAL: Final = ("lpg", "enhsp", "fd", "ff", "aries", "tamer")
_NUMERIC: Final = ("enhsp", "lpg", "tamer", "aries")
_TEMPORAL: Final = ("lpg", "aries", "tamer", "optic", "popf")
FOLDER_PREFIX: Final = "cxbridge-plan-"
"""The start of the names of the engines' work folders."""

# A search for better plans stops this long before the time limit.
_MARGIN_S: Final = 0.5


class Engine(Struct, frozen=True, kw_only=True):
    """The properties of an engine.

    :param understands: the PDDL features that the engine supports.
    :param ignores: the features that the engine accepts without effect on its plans.
    :param fails_with: the combinations of supported features with which the engine fails.
    :param proves: whether the engine's claim that no plan exists is reliable.
    """

    understands: frozenset[Need]
    ignores: frozenset[Need] = frozenset()
    fails_with: tuple[frozenset[Need], ...] = ()
    proves: bool = True


class EnginePlanner(Planner):
    """A planner on top of an engine.

    :param improve: the seconds of a search for better plans if the problem has a metric.
    :raises UnknownPlannerError: if ``improve`` is not a number.
    """

    def __init__(self, name: str, engine: Engine, improve: str) -> None:
        self.name = name
        self.understands = engine.understands
        self.ignores = engine.ignores
        self.fails_with = engine.fails_with
        self.proves = engine.proves
        self._improve_s = _parse_seconds(improve)

    @property
    def improve_s(self) -> float:
        """The seconds for the search for better plans, within the time limit."""
        return min(self._improve_s, max(0.0, self.seconds - _MARGIN_S))

    def best_so_far(self, folder: Path, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return the best plan that the engine has written before its time limit."""
        names = PlanNames(domain, problem)
        for work_folder in folder.glob(f"{FOLDER_PREFIX}*"):
            with suppress(PlanningError):  # the engine may have been writing the file when its time was over
                if plan := self.read_plan(work_folder, names):
                    return plan
        return None

    @abstractmethod
    def read_plan(self, folder: Path, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the last and best plan in an engine's folder; None without a plan.

        :raises PlanningError: if a file is not a plan.
        """

    def rank(self, needs: Collection[Need]) -> int:
        """Return the rank by measured success (docs/planning.md)."""
        order: tuple[str, ...]
        if Need.TIME in needs:
            order = _TEMPORAL
        elif Need.NUMBERS in needs:
            order = _NUMERIC
        elif self.name in _BEST_CLASSICAL:
            return DEFAULT_RANK - 1  # before pyperplan, whose rank is DEFAULT_RANK
        else:
            order = _CLASSICAL
        return DEFAULT_RANK + 1 + (order.index(self.name) if self.name in order else len(order))


def _parse_seconds(improve: str) -> float:
    try:
        seconds = float(improve)
    except ValueError:
        seconds = float("nan")
    if not isfinite(seconds):
        raise UnknownPlannerError(f"improve must be a number of seconds, not {improve!r}")
    return seconds
