from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.interfaces.fieldtypes import TYPES, parse_literal, storage_type
from cxbridge.interfaces.names import interface_type_name, message_type_name


@pytest.mark.parametrize("name", TYPES)
def test_sizes_equal_those_of_struct(name: str) -> None:
    assert {struct.calcsize(order + TYPES[name].code) for order in "=@"} == {TYPES[name].size}


def test_enum_is_stored_as_int32() -> None:
    assert storage_type("SomeEnum") is TYPES["int32"]


@pytest.mark.parametrize(
    ("type_name", "text", "value"),
    [
        ("uint8", "255", 255),
        ("uint8", "256", None),
        ("uint8", "-1", None),
        ("int8", "+5", 5),
        ("int8", " 5", 5),
        ("int8", "5 ", None),
        ("int8", "0x5", None),
        ("int8", "5_0", None),
        ("int8", "\u0665", None),
        ("int8", "", None),
        ("uint64", "9223372036854775807", (1 << 63) - 1),
        ("uint64", "9223372036854775808", None),
        ("int64", "9" * 5000, None),
        ("bool", "yes", True),
        ("bool", "0", False),
        ("bool", "True", None),
        ("float", "1.5", 1.5),
        ("float", ".5e1", 5.0),
        ("float", "1e39", None),
        ("double", "1e39", 1e39),
        ("double", "1e999999", None),
        ("double", "nan", None),
        ("string", "", ""),
        ("byte", "1", None),
        ("SomeEnum", "1", None),
    ],
)
def test_literals_are_parsed(type_name: str, text: str, value: object) -> None:
    assert parse_literal(type_name, text) == value


@given(st.floats(width=32))
def test_32_bit_float_is_unchanged(value: float) -> None:
    assert struct.pack("d", TYPES["float"].round(value)) == struct.pack("d", value)


@pytest.mark.parametrize(
    ("name", "interface", "message"),
    [
        ("Skiller", "SkillerInterface", "SkillerMessage"),
        ("InterfaceOfMine", "InterfaceOfMine", "InterfaceOfMineMessage"),
        ("MessageOfMine", "MessageOfMineInterface", "MessageOfMine"),
    ],
)
def test_type_names_get_suffix(name: str, interface: str, message: str) -> None:
    assert (interface_type_name(name), message_type_name(name)) == (interface, message)
