"""Planners of the unified-planning library: Fast Downward, Tamer, Aries and others (extra ``planners``)."""

from __future__ import annotations

import importlib
import os
import tempfile
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final, NamedTuple

from cxbridge.executive.pddl import Domain, Problem, format_domain, format_problem
from cxbridge.executive.planning.engines.names import PlanNames
from cxbridge.executive.planning.engines.needs import CLASSICAL, Need
from cxbridge.executive.planning.errors import PlanningError, UnknownPlannerError
from cxbridge.executive.planning.planner import PlannedAction, Planner


class UnifiedEngine(NamedTuple):
    """An engine of unified-planning.

    :param module: the Python module that it consists of.
    :param package: what to install for it.
    :param anytime: whether it can go on looking for better plans.
    """

    module: str
    package: str
    understands: frozenset[Need]
    anytime: bool = False


_STRIPS: Final = frozenset({Need.NEGATION, Need.EQUALITY})

ENGINES: Final = {
    "fast-downward": UnifiedEngine("up_fast_downward", "up-fast-downward", CLASSICAL),
    "aries": UnifiedEngine(
        "up_aries",
        "up-aries",
        _STRIPS | {Need.DISJUNCTION, Need.COSTS, Need.NUMBERS, Need.TIME, Need.QUANTIFIERS},
        anytime=True,
    ),
    "tamer": UnifiedEngine(
        "up_tamer", "up-tamer", _STRIPS | {Need.DISJUNCTION, Need.NUMBERS, Need.TIME, Need.QUANTIFIERS}
    ),
}
"""The engines that are known by name, in the order in which they are tried."""


class UnifiedPlanner(Planner):
    """An engine of unified-planning.

    :param name: one of :data:`ENGINES`.
    :param improve: seconds to look for better plans, when the problem has a metric and the engine can go on
        looking (aries); which of several plans comes first is left to chance, the best one seldom is.
    :raises UnknownPlannerError: when ``improve`` is not a number.
    """

    def __init__(self, name: str, improve: str = "1.0") -> None:
        self.name = name
        try:
            self._improve = float(improve)
        except ValueError:
            raise UnknownPlannerError(f"improve={improve} is not a number of seconds") from None
        self._engine = ENGINES[name]
        self.understands = self._engine.understands

    @property
    def not_installed(self) -> str:
        """Why the engine cannot be used; empty when it can."""
        for module, package in (
            ("unified_planning", "unified-planning"),
            (self._engine.module, self._engine.package),
        ):
            if find_spec(module) is None:
                return f"{self.name} is not installed: pip install {package}"
        return ""

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None when the engine says that there is none."""
        io, shortcuts = (importlib.import_module(f"unified_planning.{name}") for name in ("io", "shortcuts"))
        shortcuts.get_environment().credits_stream = None
        names = PlanNames(domain, problem)
        try:
            task = io.PDDLReader().parse_problem_string(format_domain(domain), format_problem(problem))
        except Exception as error:
            raise PlanningError(f"unified-planning cannot read the problem: {_first_line(error)}") from error
        # engines leave files behind where they stand
        with tempfile.TemporaryDirectory(prefix="cxbridge-plan-") as folder:
            before = Path.cwd()
            os.chdir(folder)
            try:
                result = self._call(shortcuts, task, improve=problem.metric is not None)
            except Exception as error:
                raise PlanningError(f"{self.name} failed: {_first_line(error)}") from error
            finally:
                os.chdir(before)
        return self._plan(result, names)

    def _call(self, shortcuts: Any, task: Any, *, improve: bool) -> Any:
        """Return the engine's result, the last one when it may go on looking."""
        if improve and self._improve > 0 and self._engine.anytime:
            with shortcuts.AnytimePlanner(name=self.name) as engine:
                _avoid_spaces(engine)
                results = list(engine.get_solutions(task, timeout=self._improve))
            found = [each for each in results if each.plan is not None]
            if found:
                return found[-1]
        with shortcuts.OneshotPlanner(name=self.name) as engine:
            _avoid_spaces(engine)
            return engine.solve(task)

    def _plan(self, result: Any, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        status = result.status.name
        if status.startswith("UNSOLVABLE"):
            return None
        if result.plan is None:
            log = "; ".join(message.message.strip() for message in result.log_messages or ())
            raise PlanningError(f"{self.name} ended with {status}: {log[-500:] or 'it does not say why'}")
        if hasattr(result.plan, "timed_actions"):
            steps = sorted(result.plan.timed_actions, key=lambda step: step[0])
            return tuple(
                _step(each, names, float(start), None if duration is None else float(duration))
                for start, each, duration in steps
            )
        return tuple(_step(each, names) for each in result.plan.actions)


def _avoid_spaces(engine: Any) -> None:
    """Let aries be found where its path has a space, at which it splits its command line (up-aries 0.5)."""
    program = getattr(engine, "_executable", "")
    if isinstance(program, str) and " " in program:
        link = Path("engine")
        if not link.is_symlink():
            link.symlink_to(program)
        engine._executable = "./engine"  # noqa: SLF001 - there is no other way to name it


def _step(
    instance: Any, names: PlanNames, start: float | None = None, duration: float | None = None
) -> PlannedAction:
    return names.step(instance.action.name, map(str, instance.actual_parameters), start, duration)


def _first_line(error: BaseException) -> str:
    return next(iter(str(error).strip().splitlines()), "") or type(error).__name__
