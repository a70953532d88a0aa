"""Messages that get all their values at once are those that get them one after the other."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import InterfaceError
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.interfaces.message import Message

REGISTRY = InterfaceRegistry()
CLASSES = [
    message
    for name in sorted(REGISTRY.names())
    for message in REGISTRY.get(name).MESSAGES.values()
    if message.SCHEMA.fields
]
ODD: list[Any] = [
    0, 1, -1, 255, 2**31, 2**32, 2**64, 1.5, float("nan"), 1e300, True, False, None, "", "a", "SUCCEEDED",
    "a\0b", "ä" * 40, "x" * 2000, "\udcff", "\ud800", b"a", (), (1, 2.0), ("a",), [True], {},
]  # fmt: skip


def one_by_one(kind: type[Message], values: list[Any]) -> Message | str:
    message = kind()
    try:
        for field, value in zip(kind.fields(), values, strict=True):
            message.set(field.name, value)
    except (InterfaceError, TypeError) as error:
        return f"{error}"
    return message


@given(st.sampled_from(CLASSES), st.data())
def test_all_at_once_is_as_one_by_one(kind: type[Message], data: st.DataObject):
    count = len(kind.fields())
    values = data.draw(st.lists(st.sampled_from(ODD), min_size=count, max_size=count))
    expected = one_by_one(kind, values)
    if isinstance(expected, str):
        with pytest.raises((InterfaceError, TypeError)) as caught:
            kind(*values)
        assert f"{caught.value}" == expected
    else:
        made = kind(*values)
        assert made.to_bytes() == expected.to_bytes()
        assert (made._changed, made._refreshed) == (expected._changed, expected._refreshed)


def test_messages_of_numbers_and_texts_are_packed():
    kind = REGISTRY.get("SkillBoardInterface").MESSAGES["FinishMessage"]
    message = kind()
    kind.FILL(message, (1, 2, "executor", "CANCELLED", "why", 0.5, "half"))
    shown = message.as_dict()
    assert shown.pop("outcome").name == "CANCELLED"
    assert list(shown.values()) == [1, 2, "executor", "why", 0.5, "half"]
