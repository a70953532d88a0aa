"""Runs of agents that are watched, for tests of properties."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cxbridge.run.options import RunOptions
from cxbridge_explore.playing import ExploredRun
from cxbridge_explore.properties.builtin.table import builtin_properties
from cxbridge_explore.properties.monitor import Property
from cxbridge_explore.properties.watch import PropertyWatch
from cxbridge_explore.worlds.points import ChoicePath, PathChooser
from tests.support import ROOT

BUILTIN = builtin_properties()


def shipped(name: str, timeout: float = 100.0) -> RunOptions:
    """Return the options of a run of a shipped scenario."""
    return RunOptions(scenario=ROOT / "scenarios" / name, skiller="none", timeout=timeout)


def watched(
    given: RunOptions,
    properties: Sequence[Property] = BUILTIN,
    path: ChoicePath | None = None,
    before: Callable[[ExploredRun], None] = lambda _: None,
) -> PropertyWatch:
    """Play a run to its end, and watch it.

    :param before: called when the run is made, before the agent is loaded.
    """
    with ExploredRun(given, properties, PathChooser(path or {})) as run:
        before(run)
        run.play()
    return run.properties
