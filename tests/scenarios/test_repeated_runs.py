"""Two runs of a shipped scenario on the virtual clock are the same, byte by byte and event by event."""

from __future__ import annotations

from pathlib import Path

import pytest
from msgspec.structs import replace

from cxbridge.events import Event, FactChange, PlannerCall
from cxbridge.run import RunOptions, run_scenario
from cxbridge.trace.formats.registry import open_run
from tests.run.test_run_temporal import INSTALLED
from tests.support import ROOT, share

TEMPORAL = "temporal"
"""Its planner, Aries, searches with several threads: it may find another plan each time."""

SCENARIOS = sorted(
    path.parent.name for path in (ROOT / "scenarios").glob("*/scenario.yaml") if path.parent.name != TEMPORAL
)


SHORTER = {"workshop": "skill-board/agents/counter/executors/referee: {orders: 2, minutes: 3.0}"}
"""Settings for less of the same: here two orders, for which each machine and each skill is needed."""


def recorded(scenario: str, folder: Path) -> tuple[bytes, list[Event]]:
    folder.mkdir()
    log, trace, config = folder / "log", folder / "run.mcap", folder.parent / "config.yaml"
    config.write_text(SHORTER.get(scenario, "{}"))
    run_scenario(
        RunOptions(
            scenario=ROOT / "scenarios" / scenario, config=config, log=log, trace=trace, trace_level="facts"
        )
    )
    # how long a planner took is real time, and documented as such
    events = [
        replace(event, duration_us=0) if isinstance(event, PlannerCall) else event
        for event in open_run(trace)
    ]
    return log.read_bytes(), events


@pytest.mark.parametrize("scenario", share(SCENARIOS, 3))
def test_log_and_trace_of_two_runs_are_the_same(scenario, tmp_path):
    log, events = recorded(scenario, tmp_path / "one")
    other_log, other_events = recorded(scenario, tmp_path / "other")
    assert log.splitlines() == other_log.splitlines()
    assert events == other_events
    assert len(events) > 100


@pytest.mark.skipif(not INSTALLED, reason="no temporal planner")
def test_what_is_known_of_a_call_of_a_planner_is_the_same_whatever_it_finds(tmp_path):
    one, other = (
        [event.text for event in events if isinstance(event, FactChange) and event.template == "planner-call"]
        for _, events in (recorded(TEMPORAL, tmp_path / name) for name in ("one", "other"))
    )
    assert one == other
    assert any("(status PLANNED)" in text and "(seconds 0.0" in text for text in one)
