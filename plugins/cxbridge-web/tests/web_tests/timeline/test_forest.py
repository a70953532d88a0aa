"""A timeline shows each goal once, whatever is its parent."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from cxbridge_web.timeline.export import write_timeline
from tests.history.test_forest import SHAPES, events
from tests.trace.runs import MemoryRun


def of_timeline(shape: dict[str, str], tmp_path: Path) -> list[str]:
    write_timeline(MemoryRun(events(shape)), tmp_path / "t.json")
    slices = json.loads((tmp_path / "t.json").read_text())["traceEvents"]
    return [each["args"]["goal"] for each in slices if each.get("cat") == "goal" and each["ph"] == "B"]


@pytest.mark.parametrize("shape", SHAPES)
def test_a_timeline_has_each_goal_once(shape: str, tmp_path: Path) -> None:
    assert sorted(of_timeline(SHAPES[shape], tmp_path)) == sorted(SHAPES[shape])
