"""Two runs of a shipped scenario on the virtual clock are the same, byte by byte and event by event."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from cxbridge.events import Event, LogLine, PlannerCall
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run
from tests.support import ROOT, scenarios_of_installed_plugins, share

SCENARIOS = {
    folder.name: "name: planner" in (folder / "scenario.yaml").read_text()
    for folder in scenarios_of_installed_plugins()
}
"""The shipped scenarios, and whether a planner plans."""

SHORTER = {"workshop": "skill-board/agents/counter/executors/referee: {orders: 2, minutes: 3.0}"}
"""Settings for less of the same: here two orders, for which each machine and each skill is needed."""

STALL_WARNING = "does not end"
"""Part of the warning about a loop that takes long on a busy machine."""


def recorded(scenario: str, folder: Path) -> tuple[list[str], list[Event]]:
    folder.mkdir()
    log, trace, config = folder / "log", folder / "run.mcap", folder.parent / "config.yaml"
    config.write_text(SHORTER.get(scenario, "{}"))
    run_scenario(
        RunOptions(
            scenario=ROOT / "scenarios" / scenario, config=config, log=log, trace=trace, trace_level="facts"
        )
    )
    # a planner's duration and the watchdog's warning depend on real time, as documented
    events = [
        replace(event, duration_us=0) if isinstance(event, PlannerCall) else event
        for event in open_run(trace)
        if not (isinstance(event, LogLine) and STALL_WARNING in event.text)
    ]
    return [line for line in log.read_text().splitlines() if STALL_WARNING not in line], events


def compare_two_runs(scenario: str, tmp_path: Path) -> None:
    """Compare logs and traces of two runs."""
    log, events = recorded(scenario, tmp_path / "one")
    other_log, other_events = recorded(scenario, tmp_path / "other")
    assert log == other_log
    assert events == other_events
    assert len(events) > 100


@pytest.mark.parametrize("scenario", share([name for name, plans in SCENARIOS.items() if not plans], 2))
def test_log_and_trace_of_two_runs_are_the_same(scenario: str, tmp_path: Path) -> None:
    compare_two_runs(scenario, tmp_path)
