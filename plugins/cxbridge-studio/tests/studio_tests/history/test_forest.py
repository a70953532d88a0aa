"""The monitor and `why` show each goal once in each shape of goal trees."""

from __future__ import annotations

import pytest

from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from cxbridge_studio.monitor.filtering import filter_goals
from cxbridge_studio.monitor.snapshot import GoalRow
from tests.history.runs import ListRun
from tests.history.test_forest import SHAPES, events


def show_in_monitor(shape: dict[str, str]) -> list[str]:
    rows = [GoalRow("env", goal, "C", parent, "SELECTED", "", "word") for goal, parent in shape.items()]
    return [row.id for row in filter_goals(rows, "word")]


def show_in_explanations(shape: dict[str, str]) -> list[str]:
    evidence = RecordedEvidence(ListRun(events(shape)), None, None)
    sample = list(shape)[:: max(1, len(shape) // 5)]
    for goal in sample:
        assert explain(evidence, goal, "goal").lines
    return list(shape)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("view", [show_in_monitor, show_in_explanations], ids=lambda view: view.__name__)
def test_each_goal_of_shape_is_shown_once(view, shape: str) -> None:
    assert sorted(view(SHAPES[shape])) == sorted(SHAPES[shape])
