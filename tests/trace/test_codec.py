"""Events as JSON: the text equals that of Python's json, as in the first recordings."""

from __future__ import annotations

import json
from enum import Enum, IntEnum
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.events import Event, GoalTransition, InterfaceWrite, Level, LogLine
from cxbridge.trace.codec import (
    EventFormatError,
    dump_json,
    encode,
    encode_with_kind,
    event_json_schema,
    make_decoder,
)
from tests.trace import events as strategies
from tests.trace.runs import goal


class Mode(IntEnum):
    SLOW = 1


def item(value: Any) -> Any:
    return value.value if isinstance(value, Level) else value.name if isinstance(value, Enum) else value


def expected_text(event: Event) -> bytes:
    """Return the text of Python's own json."""
    plain = {name: item(getattr(event, name)) for name in event.__struct_fields__}
    if "values" in plain:
        plain["values"] = {
            name: [item(element) for element in value] if isinstance(value, list | tuple) else item(value)
            for name, value in plain["values"].items()
        }
    text = json.dumps(plain, ensure_ascii=False, separators=(",", ":"), default=bytes.hex)
    return text.encode("utf-8", "backslashreplace")


any_text = st.text(st.characters())  # including halves of surrogate pairs
odd = st.one_of(
    st.floats(), st.floats(width=32), st.floats(1e-6, 1e-3), st.floats(1e15, 1e17), any_text, st.binary()
)
odd |= st.sampled_from([Mode.SLOW, None, True, 1e-4, 1e16, -0.0, -1e-5, 2**80])
odd_values = st.dictionaries(strategies.names, odd | st.lists(odd) | st.lists(st.floats()).map(tuple))
odd_events = st.builds(InterfaceWrite, strategies.times, any_text, odd_values) | st.builds(
    LogLine, strategies.times, st.sampled_from(Level), any_text, any_text
)


@given(strategies.events)
def test_events_round_trip_through_json(event: Event) -> None:
    assert make_decoder(type(event))(encode(event)) == event


@given(strategies.events | odd_events)
def test_text_equals_that_of_first_recordings(event: Event) -> None:
    assert encode(event) == expected_text(event)


@given(odd_values)
def test_values_alone_have_same_text(values: dict[str, Any]) -> None:
    assert (
        dump_json(values)
        == encode(InterfaceWrite(0, "", values)).decode()[len('{"time_us":0,"uid":"","values":') : -1]
    )


@given(odd_events)
def test_text_of_decoded_event_is_unchanged(event: Event) -> None:
    read = make_decoder(type(event))(encode(event))
    assert encode(read) == encode(event)


@given(strategies.events)
def test_kind_precedes_fields(event: Event) -> None:
    plain = json.loads(encode_with_kind(event))
    assert list(plain) == ["kind", *json.loads(encode(event))]
    assert EVENT_TYPES[plain["kind"]] is type(event)


@given(strategies.events)
def test_events_have_fields_and_types_of_schema(event: Event) -> None:
    schema = event_json_schema(type(event))
    plain = json.loads(encode(event))
    assert list(plain) == list(schema["properties"])
    assert set(schema["required"]) <= set(plain)
    types = {"integer": int, "string": str, "boolean": bool, "object": dict}
    assert all(
        type(plain[name]) is types[schema_field["type"]]
        for name, schema_field in schema["properties"].items()
    )


def test_enums_bytes_and_surrogates_are_encoded() -> None:
    event = InterfaceWrite(
        0, "A::b", {"mode": Mode.SLOW, "modes": [Mode.SLOW], "data": b"\x01\xff", "half": "\ud800"}
    )
    expected_values = {"mode": "SLOW", "modes": ["SLOW"], "data": "01ff", "half": "\ud800"}
    assert json.loads(encode(event))["values"] == expected_values


@pytest.mark.parametrize("field", ["time_us", "goal", "error"])
@pytest.mark.parametrize("change", ["missing", "wrong"])
def test_invalid_event_is_refused(field: str, change: str) -> None:
    plain = json.loads(encode(goal("gen1", "FORMULATED")))
    if change == "missing":
        del plain[field]
    else:
        plain[field] = [1]
    with pytest.raises(EventFormatError, match=f"not an event of kind goal: .*{field}"):
        make_decoder(GoalTransition)(json.dumps(plain).encode())


def test_second_kind_with_same_name_is_refused() -> None:
    with pytest.raises(ValueError, match="two kinds of events are called 'goal'"):

        class Another(Event, frozen=True):
            KIND = GoalTransition.KIND

    assert EVENT_TYPES["goal"] is GoalTransition
