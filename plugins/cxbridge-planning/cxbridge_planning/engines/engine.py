"""The base of planners with engines: supported PDDL features, rank, time for better plans.

An engine is an external program, or an engine of the library unified-planning.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Collection
from contextlib import suppress
from pathlib import Path
from typing import Final

from msgspec import Struct

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.executive.pddl.ast import number_of
from cxbridge.history.plan_steps import PlannedAction
from cxbridge_planning.errors import PlanningError, UnknownPlannerError
from cxbridge_planning.needs import Need
from cxbridge_planning.plan_files import PlanNames
from cxbridge_planning.planner import DEFAULT_RANK, Planner

# The engines by kind of problem, in the order of their measured success (docs/evidence/planning.md).
# Pyperplan stands for all planners with the rank DEFAULT_RANK.
_PYPERPLAN: Final = "pyperplan"
_CLASSICAL_ORDER: Final = ("fast-downward", _PYPERPLAN, "lpg", "enhsp", "fd", "ff", "aries", "tamer")
_NUMERIC_ORDER: Final = (_PYPERPLAN, "enhsp", "lpg", "tamer", "aries")
_TEMPORAL_ORDER: Final = (_PYPERPLAN, "lpg", "aries", "tamer", "optic", "popf")

WORK_FOLDER_PREFIX: Final = "cxbridge-plan-"
"""The start of the names of the engines' work folders."""

# A search for better plans stops this long before the time limit, which kills the process: the plan must
# still be read and checked.
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
        improve_s = number_of(improve)
        if improve_s is None:
            raise UnknownPlannerError(f"improve must be a number of seconds, not {improve!r}")
        self._improve_s = improve_s

    @property
    def improve_s(self) -> float:
        """The seconds for the search for better plans, within the time limit."""
        return min(self._improve_s, max(0.0, self.time_limit_s - _MARGIN_S))

    def best_so_far(self, folder: Path, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return the best plan that the engine has written before its time limit; None without a plan."""
        names = PlanNames(domain, problem)
        for work_folder in folder.glob(f"{WORK_FOLDER_PREFIX}*"):
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
        """Return the rank by measured success; engines without a place in the order come last."""
        order = (
            _TEMPORAL_ORDER
            if Need.TIME in needs
            else _NUMERIC_ORDER
            if Need.NUMBERS in needs
            else _CLASSICAL_ORDER
        )
        place = order.index(self.name) if self.name in order else len(order)
        return DEFAULT_RANK + place - order.index(_PYPERPLAN)
