"""The common properties of engines of all kinds: supported parts, rank, seconds to improve plans."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection
from contextlib import suppress
from math import isfinite
from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.planning.errors import PlanningError, UnknownPlannerError
from cxbridge.executive.planning.needs import Need
from cxbridge.executive.planning.planner import RANK, PlannedAction, Planner
from cxbridge_planning.plan_files import PlanNames

_FIRST: Final = ("fast-downward",)
_CLASSICAL: Final = ("lpg", "enhsp", "fd", "ff", "aries", "tamer")
_NUMERIC: Final = ("enhsp", "lpg", "tamer", "aries")
_TEMPORAL: Final = ("lpg", "aries", "tamer", "optic", "popf")
FOLDER: Final = "cxbridge-plan-"
"""Begins the names of folders in which engines work."""

_END_S: Final = 0.5
"""How long before the end of its time an engine that looks for better plans ends."""


class Engine(Struct, frozen=True, kw_only=True):
    """The properties of an engine, as of a planner.

    :param proves: whether the engine is right when it says that there is no plan.
    """

    understands: frozenset[Need]
    ignores: frozenset[Need] = frozenset()
    fails_with: tuple[frozenset[Need], ...] = ()
    proves: bool = True


class EnginePlanner(Planner):
    """A planner that an engine makes.

    :param improve: seconds to look for better plans when the problem has a metric.
    :raises UnknownPlannerError: when ``improve`` is not a number.
    """

    def __init__(self, name: str, engine: Engine, improve: str) -> None:
        self.name = name
        self.understands = engine.understands
        self.ignores = engine.ignores
        self.fails_with = engine.fails_with
        self.proves = engine.proves
        self._improve = _seconds(improve)

    @property
    def improve(self) -> float:
        """How long the engine may look for better plans, in seconds."""
        return min(self._improve, max(0.0, self.seconds - _END_S))

    def best_so_far(self, folder: Path, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return the best plan that the engine left behind when its time was over."""
        names = PlanNames(domain, problem)
        for each in folder.glob(f"{FOLDER}*"):
            with suppress(PlanningError):
                if plan := self.plan_in(each, names):
                    return plan
        return None

    @abstractmethod
    def plan_in(self, folder: Path, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the best plan in a folder of the engine, which is the last one; None when there is none.

        :raises PlanningError: when the engine wrote something else.
        """

    def rank(self, needs: Collection[Need]) -> int:
        """Return the place in the order of measured success (docs/planning.md)."""
        order: tuple[str, ...]
        if Need.TIME in needs:
            order = _TEMPORAL
        elif Need.NUMBERS in needs:
            order = _NUMERIC
        elif self.name in _FIRST:
            return RANK - 1
        else:
            order = _CLASSICAL
        return RANK + 1 + (order.index(self.name) if self.name in order else len(order))


def _seconds(improve: str) -> float:
    try:
        seconds = float(improve)
    except ValueError:
        seconds = float("nan")
    if not isfinite(seconds):
        raise UnknownPlannerError(f"improve={improve} is not a number of seconds")
    return seconds
