"""Watched runs of agents."""

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


def shipped_options(name: str, timeout: float = 100.0) -> RunOptions:
    """Return the options of a run of a shipped scenario."""
    return RunOptions(scenario=ROOT / "scenarios" / name, skiller="none", timeout=timeout)


def watch_run(
    options: RunOptions,
    properties: Sequence[Property] = BUILTIN,
    path: ChoicePath | None = None,
    before: Callable[[ExploredRun], None] = lambda _: None,
) -> PropertyWatch:
    """Watch a run to its end, and return the watch.

    :param before: called with the new run before the agent is loaded.
    """
    with ExploredRun(options, properties, PathChooser(path or {})) as run:
        before(run)
        run.play()
    return run.property_watch
