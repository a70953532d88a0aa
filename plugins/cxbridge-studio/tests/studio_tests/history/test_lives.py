"""`why` tells of both lives of a goal whose id is used twice."""

from __future__ import annotations

from pathlib import Path

import pytest

from cxbridge.history.model import goals_named
from cxbridge.run.program.finished import open_run
from cxbridge_studio.explain.answer import explain
from cxbridge_studio.explain.recorded import RecordedEvidence
from tests.history.test_lives import recorded

__all__ = ["recorded"]


@pytest.mark.parametrize("name", ["ROOM#2", "LOOK#2"])
def test_why_is_asked_by_number(recorded: Path, name: str):
    answer = explain(RecordedEvidence(open_run(recorded).source, None, None), name, "goal")
    assert answer.plain["goals"][0]["goal"] == "ROOM#2"
    assert answer.plain["goals"][0]["outcome"] == "COMPLETED"


def test_why_without_a_number_tells_of_both(recorded: Path):
    answer = explain(RecordedEvidence(open_run(recorded).source, None, None), "ROOM", "goal")
    assert [goal["outcome"] for goal in answer.plain["goals"]] == ["FAILED", "COMPLETED"]


def test_why_is_asked_by_time(recorded: Path):
    run = open_run(recorded)
    for life, name in enumerate(("ROOM", "ROOM#2")):
        end = goals_named(run.goals, "ROOM")[life].changes[-2].time / 1e6
        answer = explain(RecordedEvidence(run.source, end, None), "ROOM", "goal")
        assert [goal["goal"] for goal in answer.plain["goals"]] == [name]
