"""Fawkes' text log: the writer repeats recordings exactly, the reader accepts any text."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, FactChange, GoalTransition, Level, LogLine, RuleFired
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.formats.fawkes_log import FawkesLog, FawkesLogWriter
from cxbridge.trace.formats.files import MAX_LINE_BYTES
from cxbridge.trace.formats.registry import open_run
from cxbridge.trace.formats.transitions_text import format_transition
from tests.support import many, needs_shared
from tests.trace import events as strategies
from tests.trace.runs import NAMES, RECORDINGS, recording

ENTRY = "I 01:37:19.979849 CLIPS (executive): Initialization completed\n"


def write(path: Path, events: list[Event]) -> Path:
    with FawkesLogWriter(path, uses_utc=True) as writer:
        for event in events:
            writer.write(event)
    return path


def read(path: Path, content: str | bytes) -> tuple[list[Event], list[str]]:
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    run = open_run(path)
    assert isinstance(run, FawkesLog)
    return list(run), run.notes


def transitions(path: Path) -> list[str]:
    return [format_transition(event) for event in open_run(path) if isinstance(event, TRANSITION_TYPES)]


@needs_shared
@pytest.mark.parametrize("name", NAMES)
def test_recordings_are_read_as_by_fawkes_tools(name: str) -> None:
    run = open_run(recording(name))
    events = list(run)
    transitions = [format_transition(event) for event in events if isinstance(event, TRANSITION_TYPES)]
    assert "\n".join(transitions) + "\n" == (RECORDINGS / name / "trace.txt").read_text()
    assert sum(isinstance(event, RuleFired) for event in events) == 728
    assert not run.notes


@needs_shared
@pytest.mark.parametrize("name", NAMES)
def test_recordings_are_written_unchanged(name: str, tmp_path: Path) -> None:
    with FawkesLogWriter(tmp_path / "types") as writer:
        types = writer.event_types(RecordLevel.TRANSITIONS)
    path = write(tmp_path / "log", [event for event in open_run(recording(name)) if type(event) in types])
    assert path.read_bytes() == recording(name).read_bytes()


lines = strategies.texts.map(lambda text: text.replace("\n", " "))
log_lines = st.builds(LogLine, st.integers(0, 10**9), st.just(Level.INFO), strategies.names, lines)
firings = st.builds(
    RuleFired, st.integers(0, 10**9), strategies.names, st.integers(1, 99999), strategies.names, lines
)
facts = st.builds(
    lambda time, env, asserted, index, name, text: FactChange(
        time, env, asserted, index, name, f'({name} (a "{text}"))'
    ),
    st.integers(0, 10**9),
    strategies.names,
    st.booleans(),
    st.integers(1, 10**7),
    strategies.names,
    lines,
)


@settings(max_examples=many(60, 25))
@given(st.lists(st.one_of(log_lines, firings, facts), min_size=1, max_size=8))
def test_log_events_round_trip(tmp_path_factory: pytest.TempPathFactory, events: list[Event]) -> None:
    path = write(tmp_path_factory.mktemp("log") / "log", events)
    assert [event for event in open_run(path) if not isinstance(event, TRANSITION_TYPES)] == events


@pytest.mark.parametrize(
    ("clocks", "offsets_ms"),
    [
        (("23:59:59.000000", "00:00:01.000000", "00:00:00.500000", "00:00:02.000000"), [0, 2000, 1500, 3000]),
        (("23:59:59.900000", "00:00:00.100000", "23:59:59.950000", "00:00:00.200000"), [0, 200, 50, 300]),
        (("23:00:00.000000", "06:00:00.000000", "20:00:00.000000"), [0, 7 * 3600_000, 21 * 3600_000]),
    ],
    ids=["clock-set-back", "late-entry-of-previous-day", "quiet-day"],
)
def test_times_continue_over_midnight(tmp_path: Path, clocks: Sequence[str], offsets_ms: list[int]) -> None:
    events, _ = read(tmp_path / "log", "".join(f"I {clock} A: b\n" for clock in clocks))
    assert [(event.time_us - events[0].time_us) // 1000 for event in events] == offsets_ms


def test_bytes_outside_utf8_are_escaped(tmp_path: Path) -> None:
    events, _ = read(tmp_path / "log", b"I 01:00:00.000000 A: caf\xe9\n")
    assert events == [LogLine(3600 * MICROSECONDS, Level.INFO, "A", "caf\\xe9")]


def test_text_before_first_entry_and_broken_stamps_have_notes(tmp_path: Path) -> None:
    events, notes = read(tmp_path / "log", f"hello\n{ENTRY}D 01:37:20.000000 no component\n")
    assert len(events) == 1
    assert notes == [
        "line 1: text before the first entry, left out",
        "line 3: not a log entry, left out",
    ]


def test_truncated_fact_is_left_out_with_note(tmp_path: Path) -> None:
    fact = "D 01:37:20.000000 CLIPS (executive): ==> f-3     (goal (id gen1) (cla"
    events, notes = read(tmp_path / "log", ENTRY + fact)
    assert len(events) == 1
    assert notes == [
        "line 2: the file ends within this entry",
        "line 2: fact f-3 cannot be read: cut off within a slot",
    ]


def test_environments_have_separate_goals(tmp_path: Path) -> None:
    slots = "(class A) (sub-type nil) (parent nil) (mode M) (outcome O) (error)"
    fact = f"==> f-3     (goal (id gen1) {slots})\n"
    content = "".join(f"D 01:37:20.000000 CLIPS ({env}): {fact}" for env in ("one", "two", "one"))
    events, _ = read(tmp_path / "log", content)
    assert [event.env for event in events if isinstance(event, GoalTransition)] == ["one", "two"]


@pytest.mark.parametrize("prefix", ["", "D 01:37:20.000000 A: "])
def test_huge_line_is_refused(tmp_path: Path, prefix: str) -> None:
    path = tmp_path / "log"
    path.write_text(ENTRY + prefix + "x" * (MAX_LINE_BYTES + 1))
    with pytest.raises(TraceError, match=r"log:2: the line has more than 4 MiB"):
        list(open_run(path))


def test_huge_entry_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text(ENTRY + ("x" * 99 + "\n") * (MAX_LINE_BYTES // 100 + 10))
    with pytest.raises(TraceError, match=r"log:1: the entry has more than 4 MiB"):
        list(open_run(path))


def test_truncated_log_has_events_before_cut(tmp_path: Path) -> None:
    fact = '(SkillerInterface (id "Skiller") (skill_string "a\nb") (msgid 3) (status S_FINAL))'
    lines = (ENTRY, f"D 01:37:20.000000 CLIPS (executive): ==> f-86    {fact}\n", ENTRY)
    content = "".join(lines).encode()
    all_events, _ = read(tmp_path / "whole", content)
    assert len(all_events) >= len(lines)
    for size in range(len(content)):
        (tmp_path / "cut").write_bytes(content[:size])
        with suppress(TraceError):
            events = list(open_run(tmp_path / "cut"))
            complete = events[:-1]  # the text of the last entry may be truncated
            assert complete == all_events[: len(complete)]


def test_old_entries_are_flushed_while_writing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cxbridge.trace.formats.fawkes_log._FLUSH_INTERVAL_S", -1)
    with FawkesLogWriter(tmp_path / "log", uses_utc=True) as writer:
        writer.write(LogLine(0, Level.INFO, "A", "b"))
        assert (tmp_path / "log").read_text() == "I 00:00:00.000000 A: b\n"


@pytest.mark.parametrize(("text", "expected"), [("caf\udce9", b"caf\xe9"), ("\ud800", b"\\ud800")])
def test_text_outside_unicode_is_written(tmp_path: Path, text: str, expected: bytes) -> None:
    path = write(tmp_path / "log", [LogLine(0, Level.INFO, "A", text)])
    assert path.read_bytes() == b"I 00:00:00.000000 A: " + expected + b"\n"
