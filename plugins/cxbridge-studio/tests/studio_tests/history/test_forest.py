"""The monitor and `why` show each goal once, whatever is its parent."""

from __future__ import annotations

import pytest

from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from cxbridge_studio.monitor.filtering import filter_goals
from cxbridge_studio.monitor.snapshot import GoalRow
from tests.history.runs import ListRun
from tests.history.test_forest import SHAPES, events


def of_monitor(shape: dict[str, str]) -> list[str]:
    rows = [GoalRow("env", each, "C", above, "SELECTED", "", "word") for each, above in shape.items()]
    return [row.id for row in filter_goals(rows, "word")]


def of_explanations(shape: dict[str, str]) -> list[str]:
    evidence = RecordedEvidence(ListRun(events(shape)), None, None)
    few = list(shape)[:: max(1, len(shape) // 5)]
    for each in few:
        assert explain(evidence, each, "goal").lines
    return list(shape)


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("view", [of_monitor, of_explanations], ids=lambda view: view.__name__)
def test_each_goal_is_shown_once_whatever_is_its_parent(view, shape: str) -> None:
    assert sorted(view(SHAPES[shape])) == sorted(SHAPES[shape])
