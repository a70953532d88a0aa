"""Repeated runs of the scenarios with planners."""

from __future__ import annotations

import pytest

from cxbridge.events import FactChange
from planning_tests.scenarios.test_temporal import INSTALLED
from tests.scenarios.test_repeated_runs import SCENARIOS, compare_two_runs, recorded
from tests.support import share

TEMPORAL = "temporal"
"""The scenario whose plan may differ between runs, because Aries searches with several threads."""


@pytest.mark.parametrize(
    "scenario", share([name for name, plans in SCENARIOS.items() if plans and name != TEMPORAL], 2)
)
def test_runs_have_same_log_and_trace(scenario, tmp_path):
    compare_two_runs(scenario, tmp_path)


@pytest.mark.skipif(not INSTALLED, reason="no temporal planner")
def test_runs_have_same_facts_about_planner_calls(tmp_path):
    first, second = (
        [event.text for event in events if isinstance(event, FactChange) and event.template == "planner-call"]
        for _, events in (recorded(TEMPORAL, tmp_path / name) for name in ("first", "second"))
    )
    assert first == second
    assert any("(status PLANNED)" in text and "(seconds 0.0" in text for text in first)
