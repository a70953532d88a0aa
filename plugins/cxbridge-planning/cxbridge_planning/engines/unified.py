"""Planners of the unified-planning library: Tamer and Aries."""

from __future__ import annotations

import importlib
import os
import tempfile
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Final

from cxbridge.executive.pddl import Domain, Problem
from cxbridge.extras import pip_command
from cxbridge.history.plan_steps import PlannedAction, plan_text
from cxbridge_planning.engines.engine import WORK_FOLDER_PREFIX, Engine, EnginePlanner
from cxbridge_planning.engines.texts import read_task
from cxbridge_planning.errors import MAX_EXCERPT, PlanningError
from cxbridge_planning.needs import Need
from cxbridge_planning.plan_files import PlanNames, load_plan

_BEST_PLAN_FILE: Final = "best"


class UnifiedEngine(Engine, frozen=True):
    """An engine of unified-planning.

    :param module: the Python module of the engine.
    :param package: the package that contains the module.
    :param is_anytime: whether the engine can search for better plans.
    :param takes_integers_only: whether the engine reads only integers.
    """

    module: str
    package: str
    is_anytime: bool = False
    takes_integers_only: bool = False


# the features that both engines support
_COMMON_NEEDS: Final = frozenset(
    {
        Need.NEGATION,
        Need.EQUALITY,
        Need.DISJUNCTION,
        Need.QUANTIFIERS,
        Need.NUMERIC_CHANGES,
        Need.NUMBERS,
        Need.TIME,
    }
)

# The known engines by name.
ENGINES: Final = {
    "aries": UnifiedEngine(
        "up_aries",
        "up-aries",
        understands=_COMMON_NEEDS | {Need.COSTS, Need.HIERARCHY},
        is_anytime=True,
        takes_integers_only=True,
        # unified-planning cannot express quantifiers at a time point of a durative action
        fails_with=(frozenset({Need.TIME, Need.QUANTIFIERS}),),
    ),
    "tamer": UnifiedEngine(
        "up_tamer",
        "up-tamer",
        understands=_COMMON_NEEDS | {Need.FRACTIONS},
        ignores=frozenset({Need.COSTS}),
    ),
}


class UnifiedPlanner(EnginePlanner):
    """A planner with an engine of unified-planning.

    :param name: a key of :data:`ENGINES`.
    :param improve: the seconds of a search for better plans if the problem has a metric and the engine
        supports the search (aries). The first plan of the search is rarely the best.
    :raises UnknownPlannerError: if ``improve`` is not a number.
    """

    def __init__(self, name: str, improve: str = "1.0") -> None:
        self._engine = ENGINES[name]
        super().__init__(name, self._engine, improve)

    @property
    def unavailable_reason(self) -> str:
        """The reason why the engine cannot be used; empty if it can."""
        packages = {"unified_planning": "unified-planning", self._engine.module: self._engine.package}
        missing_packages = [package for module, package in packages.items() if find_spec(module) is None]
        command = pip_command(*missing_packages)
        return f"{self.name} is not installed: {command}" if missing_packages else ""

    def solve(self, domain: Domain, problem: Problem) -> tuple[PlannedAction, ...] | None:
        """Return a plan; None if the engine reports that none exists.

        :raises PlanningError: if the engine cannot read the problem, fails, or ends without a plan.
        """
        shortcuts = importlib.import_module("unified_planning.shortcuts")
        shortcuts.get_environment().credits_stream = None  # engines otherwise print their credits to stdout
        names = PlanNames(domain, problem)
        task = read_task(domain, problem)
        if self._engine.takes_integers_only:
            _use_integers(task)
        # engines write files into the current folder
        with tempfile.TemporaryDirectory(prefix=WORK_FOLDER_PREFIX) as folder:
            previous_folder = Path.cwd()
            os.chdir(folder)
            try:
                result = self._run_engine(shortcuts, task, names, has_metric=problem.metric is not None)
            except Exception as error:
                raise PlanningError(f"{self.name} failed: {_find_failure_reason(error)}") from error
            finally:
                os.chdir(previous_folder)
        return self._extract_plan(result, names)

    def read_plan(self, folder: Path, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the best plan so far; None without a plan.

        :raises PlanningError: if the file is not a plan.
        """
        file = folder / _BEST_PLAN_FILE
        return load_plan(file, names) if file.exists() else None

    def _run_engine(self, shortcuts: Any, task: Any, names: PlanNames, *, has_metric: bool) -> Any:
        """Return the engine's result, or the last and best result of a search for better plans."""
        if has_metric and self.improve_s > 0 and self._engine.is_anytime:
            with shortcuts.AnytimePlanner(name=self.name) as engine:
                _avoid_spaces(engine)
                best_result = None
                for result in engine.get_solutions(task, timeout=self.improve_s):
                    if result.plan is not None:
                        best_result = result
                        _save_plan(self._extract_plan(result, names))
            if best_result is not None:
                return best_result
        with shortcuts.OneshotPlanner(name=self.name) as engine:
            _avoid_spaces(engine)
            return engine.solve(task)

    def _extract_plan(self, result: Any, names: PlanNames) -> tuple[PlannedAction, ...] | None:
        """Return the plan in an engine's result; None if the engine reports that none exists.

        :raises PlanningError: if the engine gives neither a plan nor such a report.
        """
        status = result.status.name
        # UNSOLVABLE_PROVEN, or UNSOLVABLE_INCOMPLETELY of an engine that does not search all states
        if status.startswith("UNSOLVABLE"):
            return None
        if result.plan is None:
            log = " ".join("; ".join(message.message for message in result.log_messages or ()).split())
            reason = log[-MAX_EXCERPT:] or "it gives no reason"
            raise PlanningError(f"{self.name} ended with {status}: {reason}")
        if not hasattr(result.plan, "timed_actions"):
            return tuple(_make_step(instance, names) for instance in result.plan.actions)
        return tuple(
            _make_step(instance, names, float(start), None if duration is None else float(duration))
            for start, instance, duration in sorted(
                result.plan.timed_actions,
                key=lambda step: step[0],  # the start
            )
        )


# the objects that the rows of the plug-in name
aries = partial(UnifiedPlanner, "aries")
tamer = partial(UnifiedPlanner, "tamer")


def _use_integers(task: Any) -> None:
    """Change the functions of a task to integers; unified-planning reads all numbers of PDDL as reals."""
    shortcuts = importlib.import_module("unified_planning.shortcuts")
    for fluent in task.fluents:
        if fluent.type.is_real_type():
            fluent._typename = shortcuts.IntType()  # noqa: SLF001 - the reader of PDDL has no option for integers


def _save_plan(plan: tuple[PlannedAction, ...] | None) -> None:
    """Write a plan with steps into the current folder.

    The file appears atomically, because the time limit may end the process at any moment.
    """
    if plan:
        unfinished_file = Path(f"{_BEST_PLAN_FILE}.part")
        unfinished_file.write_text(plan_text(plan))
        unfinished_file.replace(_BEST_PLAN_FILE)


def _avoid_spaces(engine: Any) -> None:
    """Link an engine whose path has a space: up-aries 0.5 splits its command line at spaces."""
    program = getattr(engine, "_executable", "")
    if isinstance(program, str) and " " in program:
        link = Path("engine")
        if not link.is_symlink():
            link.symlink_to(program)
        engine._executable = "./engine"  # noqa: SLF001 - the path of the program has no public setter


def _make_step(
    instance: Any, names: PlanNames, start: float | None = None, duration: float | None = None
) -> PlannedAction:
    return names.make_step(instance.action.name, map(str, instance.actual_parameters), start, duration)


def _find_failure_reason(error: BaseException) -> str:
    """Return the reason for a failed call: the first line of the error, or its class if it has no text.

    For a gRPC error, the reason has the status and the details.
    """
    code, details = getattr(error, "code", None), getattr(error, "details", None)
    if callable(code) and callable(details):
        return f"its server no longer answers ({getattr(code(), 'name', code())}: {details()})"
    return next(iter(str(error).strip().splitlines()), "") or type(error).__name__
