"""The kept events: bounds, gaps, and what is left out of interfaces."""

from __future__ import annotations

import json

from hypothesis import given
from hypothesis import strategies as st

from cxbridge.events import InterfaceWrite, Level, LogLine, RuleFired
from cxbridge.web.event_buffer import BUNCH_BYTES, EventBuffer, EventSelection

ALL = EventSelection(frozenset({"log", "rule", "interface"}))


def line(text="x"):
    return LogLine(1, Level.INFO, "C", text)


def numbers(buffer, after=0, selection=ALL):
    return [number for number, _ in buffer.after(after, selection)[0]]


def test_events_are_counted_and_chosen_by_kind_and_environment():
    buffer = EventBuffer()
    buffer.add([line(), RuleFired(1, "a", 1, "r", "*"), RuleFired(1, "b", 1, "r", "*")])
    assert numbers(buffer) == [1, 2, 3]
    assert numbers(buffer, 1) == [2, 3]
    assert numbers(buffer, selection=EventSelection(ALL.kinds, "a")) == [1, 2]
    assert buffer.after(0, EventSelection(frozenset({"log"}))) == (
        [(1, b'{"kind":"log","time_us":1,"level":"I","component":"C","text":"x"}')],
        3,
        0,
    )


def test_what_is_gone_is_told_at_the_begin_and_in_between():
    buffer = EventBuffer(most_events=3)
    buffer.add([line() for _ in range(5)])
    assert buffer.after(0, ALL)[1:] == (5, 2)
    buffer.skip(4)
    buffer.add([line()])
    found, upto, gone = buffer.after(4, ALL)
    assert ([number for number, _ in found], upto, gone) == ([5, 10], 10, 4)


def test_bytes_are_bounded():
    buffer = EventBuffer(most_bytes=10_000)
    buffer.add([line("y" * 1000) for _ in range(50)])
    assert buffer.size <= 10_000
    assert 0 < len(buffer) < 10


def test_a_bunch_is_bounded_and_goes_on_where_it_ended():
    buffer = EventBuffer()
    buffer.add([line("z" * 1000) for _ in range(300)])
    at, seen = 0, []
    while at < buffer.newest:
        found, at, gone = buffer.after(at, ALL)
        assert gone == 0
        assert sum(len(text) for _, text in found) < BUNCH_BYTES + 2000
        seen += [number for number, _ in found]
    assert seen == list(range(1, 301))


def test_interfaces_are_told_of_when_they_have_changed_the_last_of_those_that_come_together():
    buffer = EventBuffer()

    def write(value, uid="T::a"):
        return InterfaceWrite(1, uid, {"v": value})

    buffer.add([write(1), write(2), write(9, "T::b")])
    buffer.add([write(2)])
    buffer.add([write(3)])
    values = [json.loads(text)["values"]["v"] for _, text in buffer.after(0, ALL)[0]]
    assert values == [2, 9, 3]
    buffer.forget_interfaces()
    buffer.add([write(3)])
    assert len(buffer) == 4


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 4)), max_size=30), st.integers(1, 8))
def test_everybody_gets_each_event_or_is_told_that_it_is_gone(steps, room):
    """However events come and clients read: what is sent and what is told to be gone add up."""
    buffer, at, sent, gone = EventBuffer(most_events=room), 0, 0, 0
    for count, lost in steps:
        buffer.skip(lost)
        buffer.add([line() for _ in range(count)])
        if count % 2:
            found, at, missing = buffer.after(at, ALL)
            sent, gone = sent + len(found), gone + missing
            assert at == sent + gone
    found, at, missing = buffer.after(at, ALL)
    assert sent + len(found) + gone + missing == at == buffer.newest
