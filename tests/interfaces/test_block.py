from __future__ import annotations

import struct

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.errors import InterfaceError
from cxbridge.interfaces.fieldtypes import TYPES
from tests.interfaces.samples import block_of, scalar_values
from tests.support import many

ENUM = (
    '<enum name="Mode"><comment>c</comment><item name="OFF">c</item><item name="ON" value="5">c</item></enum>'
)
VALUES = scalar_values()
SCALARS = [*VALUES]


def field(type_name: str, name: str, length: int | None = None) -> str:
    size = "" if length is None else f' length="{length}"'
    return f'<field type="{type_name}"{size} name="{name}">what it is for</field>'


BLOCK = block_of(
    *(field(name, name.upper()) for name in SCALARS),
    *(field(name, name.upper() + "_LIST", 3) for name in SCALARS),
    field("string", "text", 12),
    field("string", "letter"),
    field("string", "nothing", 1),
    field("Mode", "mode"),
    field("Mode", "modes", 3),
    field("int16", "single", 1),
    field("int8", "class"),
    field("int8", "close"),
    enums=ENUM,
)


@pytest.fixture(autouse=True)
def _zero() -> None:
    BLOCK.set_from_chunk(bytes(BLOCK.SCHEMA.datasize))
    BLOCK._changed = BLOCK._refreshed = False


def is_same(first: object, second: object) -> bool:
    return repr(first) == repr(second)  # equal for NaN, different for -0.0 and 0.0


@given(st.data())
@settings(max_examples=many(100, 25), deadline=None)
def test_scalars_are_stored_and_read(data: st.DataObject) -> None:
    for name in SCALARS:
        value = data.draw(VALUES[name])
        setattr(BLOCK, name.upper(), value)
        assert is_same(getattr(BLOCK, name.upper()), value)
        place = BLOCK.field(name.upper())
        assert is_same(struct.unpack_from("=" + place.storage.code, BLOCK.to_bytes(), place.offset)[0], value)


@given(st.data())
@settings(max_examples=many(60, 25), deadline=None)
def test_short_arrays_are_padded_with_zeros(data: st.DataObject) -> None:
    for name in SCALARS:
        values = data.draw(st.lists(VALUES[name], max_size=3))
        attribute = name.upper() + "_LIST"
        setattr(BLOCK, attribute, values)
        zeros = [TYPES[name].python_type()] * (3 - len(values))
        assert is_same(getattr(BLOCK, attribute), tuple(values + zeros))
        index = data.draw(st.integers(0, 2))
        value = data.draw(VALUES[name])
        BLOCK.set(attribute, value, index)
        assert is_same(BLOCK.get(attribute, index), value)
        assert is_same(BLOCK.get(attribute)[index], value)


@given(st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"])))
@settings(max_examples=many(200, 50), deadline=None)
def test_text_is_cut_between_characters_and_terminated(text: str) -> None:
    BLOCK.text = text
    read = BLOCK.text
    assert text.startswith(read)
    assert len(read.encode()) <= 11
    if read != text:
        assert len(read.encode()) + len(text[len(read)].encode()) > 11
    place = BLOCK.field("text")
    stored = BLOCK.to_bytes()[place.offset : place.offset + place.size]
    assert stored == read.encode().ljust(12, b"\0")


@given(st.binary(max_size=11))
@settings(deadline=None)
def test_bytes_outside_utf8_survive(data: bytes) -> None:
    data = data.replace(b"\0", b"x")
    chunk = bytearray(BLOCK.to_bytes())
    place = BLOCK.field("text")
    chunk[place.offset : place.offset + 12] = data.ljust(12, b"\0")
    BLOCK.set_from_chunk(chunk)
    text = BLOCK.text
    BLOCK.text = "something"
    BLOCK.text = text
    assert BLOCK.to_bytes() == chunk


def test_string_without_length_is_char_and_length_1_is_empty() -> None:
    BLOCK.letter = "xy"
    BLOCK.nothing = "xy"
    assert (BLOCK.letter, BLOCK.nothing) == ("x", "")


def test_enums_are_members_and_unknown_numbers_are_numbers() -> None:
    mode = type(BLOCK).Mode
    BLOCK.mode = mode.ON
    assert BLOCK.mode is mode.ON
    BLOCK.mode = 7
    assert BLOCK.mode == 7
    assert not isinstance(BLOCK.mode, mode)
    BLOCK.mode = "ON"
    assert BLOCK.mode is mode.ON
    BLOCK.modes = [mode.ON, 9]
    assert BLOCK.modes == (mode.ON, 9, mode.OFF)
    assert BLOCK.modes[0] is mode.ON
    BLOCK.modes = ("OFF", "ON")
    assert BLOCK.modes == (mode.OFF, mode.ON, mode.OFF)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        *((name.upper(), object()) for name in SCALARS),
        ("INT32", 1.5),
        ("INT32", "1"),
        ("INT32", None),
        ("BYTE", 256),
        ("BOOL", 1),
        ("BOOL", "true"),
        ("FLOAT", 1e39),
        ("FLOAT", "1"),
        ("DOUBLE", 10**400),
        ("DOUBLE", None),
        ("text", 1),
        ("text", b"bytes"),
        ("text", None),
        ("text", "\ud800"),
        ("mode", "NO_SUCH_MODE"),
        ("mode", 1 << 31),
        ("mode", 1.0),
        ("mode", "mro"),
        ("modes", ["NO_SUCH_MODE"]),
        ("INT32_LIST", [1, 2, 3, 4]),
        ("INT32_LIST", [1, 2.5]),
        ("INT32_LIST", 7),
        ("INT32_LIST", "ab"),
        ("INT32_LIST", None),
        ("INT32_LIST", iter([1, 2])),
        ("BOOL_LIST", [1, 0]),
        ("BOOL_LIST", 1),
        ("BOOL_LIST", [True] * 4),
        ("FLOAT_LIST", [1e39]),
    ],
)
def test_invalid_value_is_refused_without_change(name: str, value: object) -> None:
    BLOCK.set_from_chunk(before := bytes([1]) * BLOCK.SCHEMA.datasize)
    for assign in (lambda: setattr(BLOCK, name, value), lambda: BLOCK.set(name, value)):
        with pytest.raises(InterfaceError, match=rf"SampleInterface\.{name} of type \w+ cannot be") as caught:
            assign()
        assert (caught.value.hint or "").startswith("it holds")
    assert BLOCK.to_bytes() == before
    assert not BLOCK._changed


def test_changed_and_refreshed_flags_follow_fawkes() -> None:
    BLOCK.INT32 = 0
    assert (BLOCK._changed, BLOCK._refreshed) == (False, True)
    BLOCK.INT32 = 4
    assert BLOCK._changed
    for name, value in (
        ("text", "a"),
        ("DOUBLE_LIST", [0, 0, 1.0]),
        ("BOOL", True),
        ("mode", 5),
        ("FLOAT", 0.1),
    ):
        BLOCK._changed = BLOCK._refreshed = False
        setattr(BLOCK, name, value)
        assert (BLOCK._changed, BLOCK._refreshed) == (True, True), name
        BLOCK._changed = BLOCK._refreshed = False
        setattr(BLOCK, name, value)
        assert (BLOCK._changed, BLOCK._refreshed) == (False, True), name


def test_generic_setter_only_refreshes() -> None:
    BLOCK.set("INT32", 4)
    BLOCK.set("INT32_LIST", 4, 1)
    assert (BLOCK._changed, BLOCK._refreshed) == (False, True)
    assert BLOCK.get("INT32") == 4
    assert BLOCK.get("INT32_LIST") == (0, 4, 0)


def test_chunk_replaces_block_without_flags() -> None:
    BLOCK.INT8 = -1
    chunk = BLOCK.to_bytes()
    BLOCK.INT8 = 5
    BLOCK._changed = BLOCK._refreshed = False
    BLOCK.set_from_chunk(memoryview(chunk))
    assert BLOCK.INT8 == -1
    assert (BLOCK._changed, BLOCK._refreshed) == (False, False)
    with pytest.raises(InterfaceError, match="bytes, not 3"):
        BLOCK.set_from_chunk(b"abc")


def test_fields_are_found_by_name() -> None:
    assert BLOCK.as_dict()["INT8"] == 0
    assert list(BLOCK.as_dict()) == [field.name for field in BLOCK.fields()]
    assert (BLOCK.maxlenof("text"), BLOCK.maxlenof("INT8"), BLOCK.maxlenof("INT8_LIST")) == (12, 1, 3)
    assert type(BLOCK).INT8.__doc__ == "what it is for"
    with pytest.raises(InterfaceError, match="has no field 'no'"):
        BLOCK.get("no")
    with pytest.raises(AttributeError):
        BLOCK.no_such_field = 1


def test_indices_are_checked() -> None:
    for index in (-1, 3):
        with pytest.raises(InterfaceError, match=rf"Index value {index} is out of bounds \(0\.\.2\)"):
            BLOCK.get("INT8_LIST", index)
        with pytest.raises(InterfaceError, match="out of bounds"):
            BLOCK.set("INT8_LIST", 1, index)
    with pytest.raises(InterfaceError, match="has no index"):
        BLOCK.set("INT8", 1, 0)
    assert BLOCK.get("single", 0) == 0
