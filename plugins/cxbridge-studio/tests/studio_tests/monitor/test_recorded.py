"""A recording as the monitor sees it."""

from __future__ import annotations

import re

import pytest

from cxbridge.errors import CxbridgeError, TraceError
from cxbridge.events import FactChange, InterfaceWrite, Level, LogLine, RuleFired
from cxbridge.trace.formats.mcap.writer import McapWriter
from cxbridge_studio.monitor.filtering import format_duration
from cxbridge_studio.monitor.recorded import RecordedSource
from cxbridge_studio.monitor.snapshot import MAX_ROWS, ViewQuery
from tests.support import needs_shared
from tests.trace.runs import RECORDINGS, family, recording


def recorded(path, events):
    with McapWriter(path) as writer:
        for event in events:
            writer.write(event)
    return path


def fact(index, text, *, asserted=True, time_us=0):
    return FactChange(time_us, "executive", asserted, index, text[1:].split()[0].rstrip(")"), text)


@pytest.fixture(name="source", scope="module")
def _source(tmp_path_factory):
    events = [
        fact(1, "(plan-action (id 1) (plan-id gen1-PLAN) (goal-id gen1) (param-values a b) (state X))"),
        *[fact(index, f"(thing (n {index}))") for index in range(2, 1000)],
        *[fact(2000 + n, f"(goal (id {name}))") for n, name in enumerate(("gen1", "gen2", "RUN-gen3"))],
        *family(),
        InterfaceWrite(2_000_000, "T::a", {"n": 1, "list": [1.5, True], "text": "hello"}),
        LogLine(2_500_000, Level.WARN, "CLIPS", "mind the step"),
        RuleFired(3_000_000, "executive", 1, "last-rule", "f-1"),
        fact(2001, "(goal (id gen2))", asserted=False, time_us=4_000_000),
    ]
    return RecordedSource(recorded(tmp_path_factory.mktemp("run") / "run.mcap", events))


def at(source, *commands, **query):
    for command in commands:
        source.execute_command(command)
    return source.take_snapshot(ViewQuery(**query))


def test_it_begins_at_the_last_transition(tmp_path):
    source = RecordedSource(recorded(tmp_path / "a.mcap", [*family(), LogLine(9, Level.INFO, "x", "y")]))
    seen = source.take_snapshot(ViewQuery())
    assert seen.stop == "goal RUN-gen3 (PARENT) is FINISHED FAILED, error: SUB-GOAL-FAILED gen2"
    assert [goal.outcome for goal in seen.goals] == ["COMPLETED", "FAILED", "FAILED"]


def test_the_story_of_a_moment_is_that_of_why(source):
    assert at(source, "begin").story == ()
    end = at(source, "end", pane="story")
    assert end.story[0].startswith("RUN-gen3 (PARENT) FAILED")
    assert at(source, "begin", pane="story").story[0] != end.story[0]


def test_moments(source):
    seen = at(source, "begin", pane="events")
    assert re.fullmatch(r"0\.0 s of 4\.0 s · event 0 of 1,024", seen.head)
    assert (seen.stop, seen.progress, seen.goals, seen.events.selected) == ("the beginning", 0, [], None)
    seen = at(source, "transition 1", "event 2")
    assert [goal.id for goal in seen.goals] == ["gen1", "gen2", "RUN-gen3"]
    assert seen.environments == ["executive"]
    seen = at(source, "end", pane="events")
    assert [goal.id for goal in seen.goals] == ["gen1", "RUN-gen3"]
    assert seen.events.rows[seen.events.selected][1:] == ("fact", "<== f-2001  (goal (id gen2))")
    assert seen.progress == 1
    seen = at(source, "jump 2.6")
    assert [line.text for line in seen.log] == ["    2.500 CLIPS: mind the step"]
    assert at(source, "jump 2.4 s").log == []


def test_actions_have_the_arguments_of_their_facts(source):
    assert at(source, "jump 2.5").actions.rows == [("gen1", "1", "say", "a b", "FINAL")]
    assert at(source, "jump 2.5").skills.rows == [("Skiller", "say{}", "S_FINAL")]


def test_interfaces_and_their_values(source):
    seen = at(source, "end", interface="T::a")
    assert seen.interfaces.rows == [("T::a", "at 2.0 s", "")]
    assert seen.fields.rows == [("n", "1"), ("list", "[1.5, True]"), ("text", '"hello"')]
    assert at(source, "begin", interface="T::a").fields.note == "the interface has not been written yet"


def test_facts_are_found_beyond_those_shown(source):
    seen = at(source, "end", pane="facts")
    assert len(seen.facts.rows) == MAX_ROWS
    assert "more facts" in seen.facts.note
    assert at(source, pane="facts", filter_text="(n 99)").facts.rows == [("f-99", "(thing (n 99))")]
    assert "--trace-level facts" in at(source, pane="facts", env="nobody").facts.note


def test_goals_are_filtered_with_those_above(source):
    assert [goal.id for goal in at(source, "end", filter_text="completed").goals] == ["gen1", "RUN-gen3"]


@pytest.mark.parametrize("command", ["pause", "jump soon", "jump nan", ""])
def test_what_makes_no_sense_is_refused(source, command):
    with pytest.raises(CxbridgeError):
        source.execute_command(command)


def test_a_recording_that_was_cut_off_says_so(tmp_path):
    path = recorded(tmp_path / "a.mcap", family())
    path.write_bytes(path.read_bytes()[:-40])
    seen = RecordedSource(path).take_snapshot(ViewQuery())
    assert "cut off" in seen.notes[0]
    assert len(seen.goals) == 3


def test_no_recording_is_one_error(tmp_path):
    (tmp_path / "a.txt").write_text("hello\n")
    for path in (tmp_path / "a.txt", tmp_path / "none.mcap", tmp_path):
        with pytest.raises(TraceError):
            RecordedSource(path)


def test_a_recording_without_events_is_an_error(tmp_path):
    with pytest.raises(TraceError, match="no events"):
        RecordedSource(recorded(tmp_path / "a.mcap", []))


@needs_shared
def test_recordings_of_fawkes():
    log = RecordedSource(recording("skiller-1"))
    while log.period_s < 0.1:
        log.take_snapshot(ViewQuery())
    seen = log.take_snapshot(ViewQuery(pane="facts"))
    assert seen.facts.rows
    assert any("COMPLETED" in goal.outcome for goal in seen.goals)
    folder = RecordedSource(RECORDINGS / "skiller-1" / "bblogger-repaired")
    rows = folder.take_snapshot(ViewQuery()).interfaces.rows
    assert folder.take_snapshot(ViewQuery(interface=rows[0][0])).fields.rows


@pytest.mark.parametrize(
    ("seconds", "text"),
    [(59.94, "59.9 s"), (59.97, "1 min 00.0 s"), (125.34, "2 min 05.3 s"), (7325, "2 h 02 min 05 s")],
)
def test_a_duration_in_words(seconds, text):
    assert format_duration(seconds) == text
