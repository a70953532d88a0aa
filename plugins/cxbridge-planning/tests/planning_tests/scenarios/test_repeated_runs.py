"""Two runs of a shipped scenario with a planner are the same."""

from __future__ import annotations

import pytest

from cxbridge.events import FactChange
from planning_tests.scenarios.test_temporal import INSTALLED
from tests.scenarios.test_repeated_runs import SCENARIOS, compare_two_runs, recorded
from tests.support import share

TEMPORAL = "temporal"
"""Its planner, Aries, searches with several threads: it may find another plan each time."""


@pytest.mark.parametrize(
    "scenario", share([name for name, plans in SCENARIOS.items() if plans and name != TEMPORAL], 2)
)
def test_log_and_trace_of_two_runs_are_the_same(scenario, tmp_path):
    compare_two_runs(scenario, tmp_path)


@pytest.mark.skipif(not INSTALLED, reason="no temporal planner")
def test_what_is_known_of_a_call_of_a_planner_is_the_same_whatever_it_finds(tmp_path):
    one, other = (
        [event.text for event in events if isinstance(event, FactChange) and event.template == "planner-call"]
        for _, events in (recorded(TEMPORAL, tmp_path / name) for name in ("one", "other"))
    )
    assert one == other
    assert any("(status PLANNED)" in text and "(seconds 0.0" in text for text in one)
