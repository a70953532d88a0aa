"""Events as plain values and back."""

from __future__ import annotations

import json
from enum import IntEnum

import pytest
from hypothesis import given

from cxbridge.events import Event, InterfaceWrite
from cxbridge.trace.codec import KINDS, NAMES, EventFormatError, dump, from_plain, schema_of, to_plain
from cxbridge.trace.encoding import ENCODERS
from tests.trace import events as strategies
from tests.trace.runs import goal


class Mode(IntEnum):
    SLOW = 1


@given(strategies.events)
def test_events_round_trip_through_json(event: Event) -> None:
    assert from_plain(NAMES[type(event)], json.loads(dump(to_plain(event)))) == event


@given(strategies.events)
def test_the_fast_way_to_json_gives_the_same_text(event: Event) -> None:
    assert ENCODERS[type(event)](event) == dump(to_plain(event))


def test_every_kind_has_a_fast_way() -> None:
    assert set(ENCODERS) == set(NAMES)


@given(strategies.events)
def test_events_have_the_fields_and_types_of_their_schema(event: Event) -> None:
    schema = schema_of(type(event))
    plain = json.loads(dump(to_plain(event)))
    assert list(plain) == schema["required"] == list(schema["properties"])
    types = {"integer": int, "string": str, "boolean": bool, "object": dict}
    assert all(type(plain[name]) is types[each["type"]] for name, each in schema["properties"].items())


def test_every_kind_has_a_name() -> None:
    assert {NAMES[kind] for kind in KINDS.values()} == set(KINDS)


def test_values_of_interfaces_that_json_does_not_know() -> None:
    event = InterfaceWrite(0, "A::b", {"mode": Mode.SLOW, "modes": [Mode.SLOW], "data": b"\x01\xff"})
    assert json.loads(dump(to_plain(event)))["values"] == {"mode": "SLOW", "modes": ["SLOW"], "data": "01ff"}


@pytest.mark.parametrize("field", ["time_us", "goal", "error"])
@pytest.mark.parametrize("change", ["missing", "wrong"])
def test_what_is_no_event_is_refused(field: str, change: str) -> None:
    plain = to_plain(goal("gen1", "FORMULATED"))
    if change == "missing":
        del plain[field]
    else:
        plain[field] = [1]
    with pytest.raises(EventFormatError, match=field):
        from_plain("goal", plain)


def test_an_unknown_kind_is_refused() -> None:
    with pytest.raises(EventFormatError, match="no kind of event: 'odd'"):
        from_plain("odd", {})
