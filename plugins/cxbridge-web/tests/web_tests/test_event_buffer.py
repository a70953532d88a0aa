"""The event buffer: bounds, gaps and omitted writes of interfaces."""

from __future__ import annotations

import json
from types import SimpleNamespace
from typing import Any

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.clock import RealClock
from cxbridge.events import EventBus, GoalTransition, InterfaceWrite, Level, LogLine, RuleFired
from cxbridge_web.event_buffer import BUNCH_BYTES, EventBuffer, StreamPosition
from cxbridge_web.event_collector import MAX_PENDING, EventCollector

ALL = frozenset({"log", "rule", "interface", "goal"})
START = StreamPosition()


def at_line(lines, goals=0, lost=0, further=0):
    """Return the position after ``lines`` log lines and a number of further events."""
    return StreamPosition((goals, lines, further), lost)


def line(text="x"):
    return LogLine(1, Level.INFO, "C", text)


def goal(name="G"):
    return GoalTransition(1, "e", name, "CLASS", "", "", "FORMULATED", "UNKNOWN", "")


def texts(buffer, after=START, kinds=ALL):
    events = (json.loads(text) for _, text in buffer.read_bunch_after(after, kinds)[0])
    return [each.get("goal") or each.get("text") or each.get("env") for each in events]


def test_events_are_counted_and_selected_by_kind():
    buffer = EventBuffer()
    buffer.add([line(), RuleFired(1, "a", 1, "r", "*"), RuleFired(1, "b", 1, "r", "*")])
    assert texts(buffer) == ["x", "a", "b"]
    assert texts(buffer, at_line(1)) == ["a", "b"]
    assert texts(buffer, kinds=frozenset({"interface"})) == [], "rules are in the group of interfaces"
    assert buffer.read_bunch_after(START, frozenset({"log"})) == (
        [(at_line(1), b'{"kind":"log","time_us":1,"level":"I","component":"C","text":"x"}')],
        at_line(1, further=2),
        0,
    )


def test_late_client_gets_all_goals_and_newest_lines():
    buffer = EventBuffer(max_events=10)
    buffer.add([goal("first"), line("between"), goal("second")])
    buffer.add([line(str(number)) for number in range(1000)])
    assert texts(buffer, buffer.begin) == ["first", "second", *map(str, range(990, 1000))]
    assert buffer.read_bunch_after(buffer.begin, ALL)[2] == 0
    assert buffer.read_bunch_after(START, frozenset({"goal"}))[2] == 0, "no goal is lost"
    assert buffer.read_bunch_after(START, ALL)[2] == 991


def test_collector_keeps_goals_beyond_limit():
    bus = EventBus(RealClock())
    host: Any = SimpleNamespace(bus=bus, environments=dict)
    collector = EventCollector(host)
    for event in (line("before"), goal(), *(line() for _ in range(MAX_PENDING)), goal("last"), line("end")):
        bus.emit(event)
    events, lost = collector.take_events()
    collector.close()
    assert (events[0], events[-2], events[-1], lost) == (goal(), goal("last"), line("end"), 2)


def test_buffer_is_bounded_in_bytes():
    buffer = EventBuffer(max_bytes=10_000)
    buffer.add([line("y" * 1000) for _ in range(50)])
    assert 0 < len(texts(buffer)) < 10


def test_bunches_are_bounded_and_consecutive():
    buffer = EventBuffer()
    buffer.add([line("z" * 1000) for _ in range(300)])
    at, positions = START, []
    while at != buffer.end:
        bunch, at, lost = buffer.read_bunch_after(at, ALL)
        assert lost == 0
        assert sum(len(text) for _, text in bunch) < BUNCH_BYTES + 2000
        positions += [after for after, _ in bunch]
    assert positions == [at_line(number) for number in range(1, 301)]


def test_buffer_keeps_last_changed_write_of_interface():
    buffer = EventBuffer()

    def write(value, uid="T::a"):
        return InterfaceWrite(1, uid, {"v": value})

    buffer.add([write(1), write(2), write(9, "T::b")])
    buffer.add([write(2)])
    buffer.add([write(3)])
    values = [json.loads(text)["values"]["v"] for _, text in buffer.read_bunch_after(START, ALL)[0]]
    assert values == [2, 9, 3]
    buffer.forget_interfaces()
    buffer.add([write(3)])
    assert len(buffer.read_bunch_after(START, ALL)[0]) == 4


STEP = st.tuples(st.integers(0, 5), st.integers(0, 5), st.integers(0, 4))


@given(st.lists(STEP, max_size=30), st.integers(1, 8))
def test_sent_and_lost_events_add_up(steps, room):
    """The steps are any sequence of events and reads."""
    buffer, at, sent, missed = EventBuffer(max_events=room), START, 0, 0
    for goals, lines, lost in steps:
        buffer.count_lost(lost)
        buffer.add([*(line() for _ in range(lines)), *(goal() for _ in range(goals))])
        if lines % 2:
            bunch, at, missing = buffer.read_bunch_after(at, ALL)
            sent, missed = sent + len(bunch), missed + missing
            assert sum(at.counts) + at.lost == sent + missed
    bunch, at, missing = buffer.read_bunch_after(at, ALL)
    assert sent + len(bunch) + missed + missing == sum(at.counts) + at.lost
    assert at == buffer.end
