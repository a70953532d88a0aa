"""A recorded run at any of its moments."""

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


def loaded(events, stride=4):
    made = Scrubber(MemoryRun(events), stride)
    while made.is_loading:
        made.load(1)
    return made


def facts(numbers):
    """Each number asserts its fact, or retracts it when it is there."""
    there: set[int] = set()
    for number in numbers:
        yield FactChange(0, "e", number not in there, number, "n", f"(n {number})")
        there ^= {number}


@given(st.lists(st.integers(0, 5), max_size=40), st.lists(st.integers(-2, 45), max_size=8), st.integers(1, 9))
@settings(max_examples=many(60, 25), deadline=None)
def test_however_it_is_reached_a_moment_is_the_same(numbers, path, stride):
    events = list(facts(numbers))
    it = loaded(events, stride)
    for at in path:
        it.go_to(at)
        fresh = RunState()
        for event in events[: it.position]:
            fresh.add_event(event)
        assert it.position == max(0, min(at, len(events)))
        assert it.state.facts.by_env.get("e", {}) == fresh.facts.by_env.get("e", {})


def test_transitions_forth_and_back():
    events = [
        goal("a", "FORMULATED"),
        LogLine(0, Level.INFO, "x", "y"),
        goal("a", "SELECTED"),
        skill("s", "S_FINAL"),
    ]
    it = loaded([*events, skill("s", "S_FINAL"), LogLine(0, Level.INFO, "x", "z")])
    assert list(it.transitions) == [1, 3, 4]
    seen = []
    for step in (1, 1, 1, 1, 1, -1, -1, -1, -1, -1, 2, -1):
        it.step_transitions(step)
        seen.append(it.position)
    assert seen == [1, 3, 4, 6, 6, 4, 3, 1, 0, 0, 3, 1]
    it.go_to(2)
    it.step_transitions(-1)
    assert it.position == 1
    assert list(it.log_lines) == [1, 5]


def test_times():
    events = [
        goal("a", mode, time_us=5_000_000 + time)
        for mode, time in (("A", 0), ("B", 10), ("C", 10), ("D", 30))
    ]
    it = loaded(events)
    assert it.end_us == 30
    for time_us, at in ((-1, 0), (0, 1), (9, 1), (10, 3), (29, 3), (30, 4), (10**9, 4)):
        it.go_to_time(time_us)
        assert it.position == at
    assert it.now_us == 30


def test_what_is_no_event_for_people_does_not_count():
    it = loaded([SourceRead(0, "clips", "", "a.clp", None, {}), *family()])
    assert len(it.events) == len(family())


def test_a_run_that_cannot_be_read_to_its_end_is_there_up_to_then():
    class Broken(MemoryRun):
        def __iter__(self):
            yield from self.events
            raise TraceError("the disk is gone")

    it = Scrubber(Broken(family()))
    it.load(10)
    assert not it.is_loading
    assert len(it.events) == len(family())
    assert it.notes == ["the rest cannot be read: the disk is gone"]


def test_the_first_events_of_a_very_long_run(monkeypatch):
    monkeypatch.setattr(scrubbing, "MAX_EVENTS", 500)
    it = Scrubber(MemoryRun([LogLine(0, Level.INFO, "x", "y")] * 1200))
    it.load(10)
    assert len(it.events) == 500
    assert "only the first 500 events" in it.notes[0]
