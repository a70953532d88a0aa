"""What of a run is kept for a page."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import (
    FactChange,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    RuleFired,
    SkillStatus,
)
from cxbridge.history.model import goal_forest
from cxbridge.trace.formats.registry import open_run
from cxbridge_web.timeline.reading import BIN_US, TimelineLimits, read_timeline
from tests.trace.events import events
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun, action, family, recording

SMALL = TimelineLimits(goals=2, actions=1, calls=1, transitions=3, log=2, writes=2, firings=2)


def test_of_writes_the_changes_are_kept():
    values = ({"x": 1.5, "on": True}, {"x": 1.5, "on": True}, {"x": 1.5, "on": False})
    data = read_timeline(
        MemoryRun([InterfaceWrite(time, "T::i", value) for time, value in enumerate(values)])
    )
    assert [row[2] for row in data.changes.items()] == [{"x": "1.5", "on": "true"}, {"on": "false"}]


def test_messages_are_told_with_their_interface():
    message = InterfaceMessage(7, "T::i", "ExecSkillMessage", 4, "me", "queued", {"skill_string": "say{}"})
    data = read_timeline(MemoryRun([message]))
    assert data.messages.items() == [
        ((0, 0), "T::i", "ExecSkillMessage 4 queued from me: skill_string=say{}")
    ]
    assert list(data.interfaces) == ["T::i"]


def test_the_number_of_facts_has_one_value_in_each_bin():
    changes = [FactChange(time, "e", True, time, "t", "(t)") for time in range(0, 3 * BIN_US, 100)]
    data = read_timeline(MemoryRun(changes))
    assert [count for _, count in data.facts.values()] == [1000, 2000, 3000]


def test_what_is_left_out_is_told():
    lines = [LogLine(0, Level.INFO, "c", str(number)) for number in range(5)]
    writes = [InterfaceWrite(0, "T::i", {"x": number}) for number in range(5)]
    firings = [RuleFired(0, "e", 1, f"r{number}", "") for number in range(5)]
    skills = [
        SkillStatus(0, "executive", "Skiller", text, number, state)
        for number, text, state in ((1, "a", "S_RUNNING"), (2, "b", "S_RUNNING"), (2, "b", "S_FINAL"))
    ]
    actions = [action("gen1", str(number), "FORMULATED") for number in range(2)]
    data = read_timeline(MemoryRun([*family(), *actions, *lines, *writes, *firings, *skills]), SMALL)
    text = "\n".join(data.notes)
    assert "3 of 5 log lines of level I" in text
    assert "3 of 5 interface writes" in text
    assert "3 of 5 firings" in text
    for what in ("goals beyond", "plan-actions beyond", "calls of skills", "the first and the last of each"):
        assert what in text
    first, second = data.history.goals
    assert (first.changes[0].mode, first.changes[-1].outcome) == ("FORMULATED", "COMPLETED")
    assert (second.changes[0].mode, second.changes[-1].outcome) == ("FORMULATED", "FAILED")


def test_an_empty_run():
    data = read_timeline(MemoryRun([]))
    assert (data.history.event_count, data.history.end, data.history.clock.first_us) == (0, 0, None)


@given(st.lists(events, max_size=30))
def test_any_events_can_be_read(several):
    data = read_timeline(MemoryRun(several))
    assert data.history.event_count == len(several)
    assert all(at.seq <= data.history.event_count for each in data.history.goals for at in each.changes)
    read_timeline(MemoryRun(several), SMALL)


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs the recordings of Fawkes, shared/traces")
@pytest.mark.parametrize("name", NAMES)
def test_the_recordings_of_fawkes(name):
    data = read_timeline(open_run(recording(name)))
    assert len(data.history.goals) == 20
    assert data.firings.total == 728
    assert [call.status for call in data.history.calls] == ["S_FINAL"] * 4
    goals = data.history.goals
    assert [goals[number].outcome for number in goal_forest(goals).roots] == ["COMPLETED"]
