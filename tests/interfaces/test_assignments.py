"""``NAME=VALUE`` assigns fields of all types: printed values are accepted, invalid values are refused."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.assignments import assign, field_text
from cxbridge.interfaces.fieldtypes import TYPES
from tests.interfaces.samples import block_of, scalar_values

_ENUM = (
    '<enum name="Mode"><comment>c</comment><item name="OFF">c</item><item name="ON" value="5">c</item></enum>'
)
_VALUES: dict[str, st.SearchStrategy[Any]] = {
    **scalar_values(allow_nan=False),
    "string": st.text(st.sampled_from("aä\"',[]=\\ \n\x1b\udcff"), max_size=5),
    "Mode": st.sampled_from(["OFF", "ON"]),
}
"""Possible values of each type; a type without values fails the test."""


def _fields() -> list[str]:
    fields = []
    for name in (*TYPES, "Mode"):
        length = ' length="12"' if name == "string" else ""
        fields.append(f'<field type="{name}"{length} name="a_{name}">what it is for</field>')
        if name != "string":
            fields.append(f'<field type="{name}" length="3" name="some_{name}">what it is for</field>')
    return fields


def _block() -> Any:
    return block_of(*_fields(), enums=_ENUM)


@given(st.data())
def test_printed_values_are_accepted(data: st.DataObject):
    block, copy = _block(), _block()
    for field in block.fields():
        value = _VALUES[field.type]
        block.set(field.name, data.draw(st.tuples(value, value, value) if field.is_array else value))
    texts = {
        name: value if isinstance(value, str) else field_text(value)
        for name, value in block.as_dict().items()
    }
    assign(copy, [f"{name}={text}" for name, text in texts.items()])
    assert copy.as_dict() == block.as_dict()


@pytest.mark.parametrize(
    ("assignment", "name", "value"),
    [
        ("a_uint32=007", "a_uint32", 7),
        ("some_int8=01,2,3", "some_int8", (1, 2, 3)),
        ("a_Mode=5", "a_Mode", 5),
        ("a_string=plain", "a_string", "plain"),
        ("a_string=elevenbytes", "a_string", "elevenbytes"),
    ],
)
def test_typed_values_are_converted(assignment: str, name: str, value: object):
    block = _block()
    assert assign(block, [assignment])
    assert block.get(name) == value


@pytest.mark.parametrize(
    ("assignment", "problem"),
    [
        ("a_Mode=9", "one of OFF, ON"),
        ("a_Mode=MAYBE", "one of OFF, ON"),
        ("some_Mode=OFF,9,ON", "one of OFF, ON"),
        ("a_string=twelve bytes", "a_string holds 11 bytes"),
        ("a_string=öööööö", "does not fit"),
        ("a_string=a\0b", "without NUL"),
        ("a_uint8=256", "an integer from 0 to 255"),
        ("a_bool=maybe", "True or False"),
    ],
)
def test_invalid_values_are_refused(assignment: str, problem: str):
    block = _block()
    with pytest.raises(InterfaceError) as caught:
        assign(block, [assignment])
    assert problem in str(caught.value)
    assert not any(block.to_bytes())
