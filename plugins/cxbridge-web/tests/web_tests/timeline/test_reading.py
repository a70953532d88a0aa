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
from cxbridge_web.timeline.model import ReportLimits
from cxbridge_web.timeline.reading import FACT_POINTS, read
from tests.trace.events import events
from tests.trace.runs import NAMES, RECORDINGS, MemoryRun, action, family, recording

SMALL = ReportLimits(goals=2, actions=1, calls=1, transitions=3, log=2, writes=2, firings=2)


def test_rules_are_counted_with_first_and_last():
    model = read(MemoryRun([RuleFired(time, "e", 1, "r", "f-1") for time in (5, 7, 9)]))
    (rule,) = model.rules
    assert (rule.name, rule.count, rule.first, rule.last) == ("r", 3, (0, 0), (2, 4))
    assert model.firings.items() == [(0, 0, 0), (1, 2, 0), (2, 4, 0)]


def test_of_writes_the_changes_are_kept():
    values = ({"x": 1.5, "on": True}, {"x": 1.5, "on": True}, {"x": 1.5, "on": False})
    model = read(MemoryRun([InterfaceWrite(time, "T::i", value) for time, value in enumerate(values)]))
    assert [row[3] for row in model.changes.items()] == [{"x": "1.5", "on": "true"}, {"on": "false"}]
    (count,) = model.interfaces
    assert (count.writes, count.changes, count.first, count.last) == (3, 2, 0, 2)


def test_messages_are_told_with_their_interface():
    message = InterfaceMessage(7, "T::i", "ExecSkillMessage", 4, "me", "queued", {"skill_string": "say{}"})
    model = read(MemoryRun([message]))
    assert [row[3] for row in model.messages.items()] == [
        "ExecSkillMessage 4 queued from me: skill_string=say{}"
    ]
    assert (model.interfaces[0].messages, model.interfaces[0].writes) == (1, 0)


def test_the_curve_of_facts_is_bounded_and_ends_right():
    changes = [FactChange(time, "e", True, time, "t", "(t)") for time in range(3 * FACT_POINTS)]
    model = read(MemoryRun(changes))
    assert len(model.facts) <= FACT_POINTS
    assert model.facts[-1] == (len(changes) - 1, len(changes) - 1, len(changes))


def test_what_is_left_out_is_told():
    lines = [LogLine(0, Level.INFO, "c", str(number)) for number in range(5)]
    writes = [InterfaceWrite(0, "T::i", {"x": number}) for number in range(5)]
    firings = [RuleFired(0, "e", 1, f"r{number}", "") for number in range(5)]
    skills = [
        SkillStatus(0, "executive", "Skiller", text, number, state)
        for number, text, state in ((1, "a", "S_RUNNING"), (2, "b", "S_RUNNING"), (2, "b", "S_FINAL"))
    ]
    actions = [action("gen1", str(number), "FORMULATED") for number in range(2)]
    model = read(MemoryRun([*family(), *actions, *lines, *writes, *firings, *skills]), SMALL)
    text = "\n".join(model.notes)
    assert "3 of 5 log lines of level I" in text
    assert "3 of 5 interface writes" in text
    assert "3 of 5 firings" in text
    assert len(model.rules) == 5
    for what in ("goals beyond", "plan-actions beyond", "calls of skills", "the first and the last of each"):
        assert what in text
    first, second = model.history.goals
    assert (first.changes[0].mode, first.changes[-1].outcome) == ("FORMULATED", "COMPLETED")
    assert (second.changes[0].mode, second.changes[-1].outcome) == ("FORMULATED", "FAILED")


def test_an_empty_run():
    model = read(MemoryRun([]))
    assert (model.history.events, model.history.end, model.history.clock.first_us) == (0, 0, None)


@given(st.lists(events, max_size=30))
def test_any_events_can_be_read(several):
    model = read(MemoryRun(several))
    assert model.history.events == len(several)
    assert all(at.seq <= model.history.events for each in model.history.goals for at in each.changes)
    read(MemoryRun(several), SMALL)


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs the recordings of Fawkes, shared/traces")
@pytest.mark.parametrize("name", NAMES)
def test_the_recordings_of_fawkes(name):
    model = read(open_run(recording(name)))
    assert len(model.history.goals) == 20
    assert sum(rule.count for rule in model.rules) == 728
    assert [call.status for call in model.history.calls] == ["S_FINAL"] * 4
    goals = model.history.goals
    assert [goals[number].outcome for number in goal_forest(goals).roots] == ["COMPLETED"]
