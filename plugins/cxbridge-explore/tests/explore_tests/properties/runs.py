"""Runs of agents that are watched, for tests of properties."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from cxbridge.run.options import RunOptions
from cxbridge.run.stuck import StuckWatch
from cxbridge_explore.properties.builtin.table import builtin_properties
from cxbridge_explore.properties.monitor import Ending, Property, RunEnd, Violation
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.worlds.points import ChoicePath, PathChooser
from cxbridge_explore.worlds.run import WorldResult, WorldRun
from tests.support import ROOT

BUILTIN = builtin_properties()


@dataclass(frozen=True)
class Watched:
    """A run that was watched."""

    result: WorldResult
    violations: list[Violation]
    evaluated: frozenset[str]
    states: list[object]

    def of(self, name: str) -> Violation | None:
        """Return how a property was violated."""
        return next((each for each in self.violations if each.property == name), None)


def shipped(name: str, timeout: float = 100.0) -> RunOptions:
    """Return the options of a run of a shipped scenario."""
    return options(ROOT / "scenarios" / name, timeout)


def options(folder: Path, timeout: float = 100.0) -> RunOptions:
    """Return the options of a run of an agent."""
    return RunOptions(scenario=folder, skiller="none", timeout=timeout)


def watched(
    given: RunOptions,
    properties: Sequence[Property] = BUILTIN,
    path: ChoicePath | None = None,
    before: Callable[[WorldRun], None] = lambda _: None,
) -> Watched:
    """Play a run to its end, and watch it.

    :param before: called when the run is made, before the agent is loaded.
    """
    states = []
    with WorldRun(given, PathChooser(path or {})) as run:
        watch = PropertyWatch(properties, run.assembly.agents, run.assembly.clock)
        stuck = StuckWatch(run.assembly)
        before(run)
        is_stuck = False

        def look() -> bool:
            nonlocal is_stuck
            watch.check()
            states.append(watch.state())
            is_stuck = stuck.check()
            return is_stuck

        result = run.play(look)
        ending = Ending.OVER if result.is_over else Ending.STUCK if is_stuck else Ending.CUT
        watch.check_end(RunEnd(ending))
        run.assembly.finalize()
        watch.check_shutdown()
    return Watched(result, watch.violations, watch.evaluated_names, states)
