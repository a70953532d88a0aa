"""The source of the monitor for a recording."""

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


def write_recording(path, events):
    with McapWriter(path) as writer:
        for event in events:
            writer.write(event)
    return path


def make_fact(index, text, *, asserted=True, time_us=0):
    return FactChange(time_us, "executive", asserted, index, text[1:].split()[0].rstrip(")"), text)


@pytest.fixture(name="source", scope="module")
def _source(tmp_path_factory):
    events = [
        make_fact(1, "(plan-action (id 1) (plan-id gen1-PLAN) (goal-id gen1) (param-values a b) (state X))"),
        *[make_fact(index, f"(thing (n {index}))") for index in range(2, 1000)],
        *[make_fact(2000 + n, f"(goal (id {name}))") for n, name in enumerate(("gen1", "gen2", "RUN-gen3"))],
        *family(),
        InterfaceWrite(2_000_000, "T::a", {"n": 1, "list": [1.5, True], "text": "hello"}),
        LogLine(2_500_000, Level.WARN, "CLIPS", "mind the step"),
        RuleFired(3_000_000, "executive", 1, "last-rule", "f-1"),
        make_fact(2001, "(goal (id gen2))", asserted=False, time_us=4_000_000),
    ]
    return RecordedSource(write_recording(tmp_path_factory.mktemp("run") / "run.mcap", events))


def take_snapshot_after(source, *commands, **query):
    for command in commands:
        source.execute_command(command)
    return source.take_snapshot(ViewQuery(**query))


def test_source_begins_at_last_transition(tmp_path):
    source = RecordedSource(
        write_recording(tmp_path / "a.mcap", [*family(), LogLine(9, Level.INFO, "x", "y")])
    )
    snapshot = source.take_snapshot(ViewQuery())
    assert snapshot.stop == "goal RUN-gen3 (PARENT) is FINISHED FAILED, error: SUB-GOAL-FAILED gen2"
    assert [goal.outcome for goal in snapshot.goals] == ["COMPLETED", "FAILED", "FAILED"]


def test_story_follows_position_in_recording(source):
    assert take_snapshot_after(source, "begin").story == ()
    end = take_snapshot_after(source, "end", pane="story")
    assert end.story[0].startswith("RUN-gen3 (PARENT) FAILED")
    assert take_snapshot_after(source, "begin", pane="story").story[0] != end.story[0]


def test_snapshots_at_positions_of_recording(source):
    snapshot = take_snapshot_after(source, "begin", pane="events")
    assert re.fullmatch(r"0\.0 s of 4\.0 s · event 0 of 1,024", snapshot.head)
    assert (snapshot.stop, snapshot.progress, snapshot.goals, snapshot.events.selected) == (
        "the beginning",
        0,
        [],
        None,
    )
    snapshot = take_snapshot_after(source, "transition 1", "event 2")
    assert [goal.id for goal in snapshot.goals] == ["gen1", "gen2", "RUN-gen3"]
    assert snapshot.environments == ["executive"]
    snapshot = take_snapshot_after(source, "end", pane="events")
    assert [goal.id for goal in snapshot.goals] == ["gen1", "RUN-gen3"]
    assert snapshot.events.rows[snapshot.events.selected][1:] == ("fact", "<== f-2001  (goal (id gen2))")
    assert snapshot.progress == 1
    snapshot = take_snapshot_after(source, "jump 2.6")
    assert [line.text for line in snapshot.log] == ["    2.500 CLIPS: mind the step"]
    assert take_snapshot_after(source, "jump 2.4 s").log == []


def test_actions_have_arguments_of_their_facts(source):
    assert take_snapshot_after(source, "jump 2.5").actions.rows == [("gen1", "1", "say", "a b", "FINAL")]
    assert take_snapshot_after(source, "jump 2.5").skills.rows == [("Skiller", "say{}", "S_FINAL")]


def test_interfaces_have_their_values(source):
    snapshot = take_snapshot_after(source, "end", interface="T::a")
    assert snapshot.interfaces.rows == [("T::a", "at 2.0 s", "")]
    assert snapshot.fields.rows == [("n", "1"), ("list", "[1.5, True]"), ("text", '"hello"')]
    assert (
        take_snapshot_after(source, "begin", interface="T::a").fields.note
        == "the interface has not been written yet"
    )


def test_filter_finds_facts_beyond_shown_rows(source):
    snapshot = take_snapshot_after(source, "end", pane="facts")
    assert len(snapshot.facts.rows) == MAX_ROWS
    assert "more facts" in snapshot.facts.note
    assert take_snapshot_after(source, pane="facts", filter_text="(n 99)").facts.rows == [
        ("f-99", "(thing (n 99))")
    ]
    assert "--trace-level facts" in take_snapshot_after(source, pane="facts", env="unknown").facts.note


def test_filtered_goals_have_their_parents(source):
    assert [goal.id for goal in take_snapshot_after(source, "end", filter_text="completed").goals] == [
        "gen1",
        "RUN-gen3",
    ]


@pytest.mark.parametrize("command", ["pause", "jump soon", "jump nan", ""])
def test_invalid_command_is_an_error(source, command):
    with pytest.raises(CxbridgeError):
        source.execute_command(command)


def test_truncated_recording_has_note(tmp_path):
    path = write_recording(tmp_path / "a.mcap", family())
    path.write_bytes(path.read_bytes()[:-40])
    snapshot = RecordedSource(path).take_snapshot(ViewQuery())
    assert "cut off" in snapshot.notes[0]
    assert len(snapshot.goals) == 3


def test_invalid_recording_is_an_error(tmp_path):
    (tmp_path / "a.txt").write_text("hello\n")
    for path in (tmp_path / "a.txt", tmp_path / "none.mcap", tmp_path):
        with pytest.raises(TraceError):
            RecordedSource(path)


def test_recording_without_events_is_an_error(tmp_path):
    with pytest.raises(TraceError, match="no events"):
        RecordedSource(write_recording(tmp_path / "a.mcap", []))


@needs_shared
def test_recordings_of_fawkes_are_shown():
    log = RecordedSource(recording("skiller-1"))
    while log.period_s < 0.1:
        log.take_snapshot(ViewQuery())
    snapshot = log.take_snapshot(ViewQuery(pane="facts"))
    assert snapshot.facts.rows
    assert any("COMPLETED" in goal.outcome for goal in snapshot.goals)
    folder = RecordedSource(RECORDINGS / "skiller-1" / "bblogger-repaired")
    rows = folder.take_snapshot(ViewQuery()).interfaces.rows
    assert folder.take_snapshot(ViewQuery(interface=rows[0][0])).fields.rows


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (59.94, "59.9 s"),
        (59.97, "1 min 00.0 s"),
        (125.34, "2 min 05.3 s"),
        (3659.6, "1 h 01 min 00 s"),
        (7325, "2 h 02 min 05 s"),
    ],
)
def test_duration_is_formatted(seconds, text):
    assert format_duration(seconds) == text
