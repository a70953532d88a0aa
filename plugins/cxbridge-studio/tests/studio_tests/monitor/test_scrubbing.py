"""Positions in a recorded run."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.errors import TraceError
from cxbridge.events import FactChange, Level, LogLine, SourceRead
from cxbridge_studio.monitor import scrubbing
from cxbridge_studio.monitor.scrubbing import Scrubber
from cxbridge_studio.recorded_state import RunState
from tests.support import many
from tests.trace.runs import MemoryRun, family, goal, skill


def load_scrubber(events, stride=4):
    scrubber = Scrubber(MemoryRun(events), stride)
    while scrubber.is_loading:
        scrubber.load(1)
    return scrubber


def make_fact_changes(numbers):
    """Yield an assertion of the fact of each number, or its retraction if the fact exists."""
    existing: set[int] = set()
    for number in numbers:
        yield FactChange(0, "e", number not in existing, number, "n", f"(n {number})")
        existing ^= {number}


@given(st.lists(st.integers(0, 5), max_size=40), st.lists(st.integers(-2, 45), max_size=8), st.integers(1, 9))
@settings(max_examples=many(60, 25), deadline=None)
def test_state_at_position_does_not_depend_on_path(numbers, path, stride):
    events = list(make_fact_changes(numbers))
    scrubber = load_scrubber(events, stride)
    for at in path:
        scrubber.go_to(at)
        fresh = RunState()
        for event in events[: scrubber.position]:
            fresh.add_event(event)
        assert scrubber.position == max(0, min(at, len(events)))
        assert scrubber.state.facts.by_env.get("e", {}) == fresh.facts.by_env.get("e", {})


def test_steps_go_to_next_and_previous_transitions():
    events = [
        goal("a", "FORMULATED"),
        LogLine(0, Level.INFO, "x", "y"),
        goal("a", "SELECTED"),
        skill("s", "S_FINAL"),
    ]
    scrubber = load_scrubber([*events, skill("s", "S_FINAL"), LogLine(0, Level.INFO, "x", "z")])
    assert list(scrubber.transitions) == [1, 3, 4]
    positions = []
    for step in (1, 1, 1, 1, 1, -1, -1, -1, -1, -1, 2, -1):
        scrubber.step_transitions(step)
        positions.append(scrubber.position)
    assert positions == [1, 3, 4, 6, 6, 4, 3, 1, 0, 0, 3, 1]
    scrubber.go_to(2)
    scrubber.step_transitions(-1)
    assert scrubber.position == 1
    assert list(scrubber.log_lines) == [1, 5]


def test_time_selects_position():
    events = [
        goal("a", mode, time_us=5_000_000 + time)
        for mode, time in (("A", 0), ("B", 10), ("C", 10), ("D", 30))
    ]
    scrubber = load_scrubber(events)
    assert scrubber.end_us == 30
    for time_us, at in ((-1, 0), (0, 1), (9, 1), (10, 3), (29, 3), (30, 4), (10**9, 4)):
        scrubber.go_to_time(time_us)
        assert scrubber.position == at
    assert scrubber.now_us == 30


def test_source_records_do_not_count_as_events():
    scrubber = load_scrubber([SourceRead(0, "clips", "", "a.clp", None, {}), *family()])
    assert len(scrubber.events) == len(family())


def test_partly_unreadable_run_has_events_before_error():
    class Broken(MemoryRun):
        def __iter__(self):
            yield from self.events
            raise TraceError("the disk is gone")

    scrubber = Scrubber(Broken(family()))
    scrubber.load(10)
    assert not scrubber.is_loading
    assert len(scrubber.events) == len(family())
    assert scrubber.notes == ["the rest cannot be read: the disk is gone"]


def test_events_of_very_long_run_have_limit(monkeypatch):
    monkeypatch.setattr(scrubbing, "MAX_EVENTS", 500)
    scrubber = Scrubber(MemoryRun([LogLine(0, Level.INFO, "x", "y")] * 1200))
    scrubber.load(10)
    assert len(scrubber.events) == 500
    assert "only the first 500 events" in scrubber.notes[0]
