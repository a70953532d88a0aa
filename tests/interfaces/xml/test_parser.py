from __future__ import annotations

import hashlib
import time
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.interfaces.xml.parser import check_bytes, check_file, parse_bytes, parse_file
from tests.interfaces.mistakes import MISTAKES
from tests.interfaces.samples import DATA, DOCTYPE, data_block, definition, schema_xml, schemas
from tests.support import many


@pytest.mark.parametrize(
    ("data", "line", "message"),
    [case[1:] for case in MISTAKES],
    ids=[case[0] for case in MISTAKES],
)
def test_mistake_is_error_with_line(data: bytes, line: int, message: str) -> None:
    result = check_bytes(data, "x.xml")
    assert result.schema is None
    error = result.errors[0]
    assert message in error.message
    assert (error.file, error.line) == ("x.xml", line)
    with pytest.raises(InterfaceDefinitionError) as caught:
        parse_bytes(data, "x.xml")
    assert caught.value.location == error.location


def test_all_mistakes_of_file_are_found() -> None:
    data = data_block(
        '<field type="uint33" name="a">c</field>',
        '<field type="int8" name="read" length="0">c</field>',
        '<field type="int8" name="b"/>',
    )
    errors = check_bytes(data, "x.xml").errors
    assert [(error.line, error.column) for error in errors] == [(3, 1), (4, 1), (5, 1)]
    with pytest.raises(InterfaceDefinitionError, match="unknown type"):
        parse_bytes(data)


@pytest.mark.parametrize(
    "head",
    [
        "",
        DOCTYPE,
        "<!DOCTYPE interface>",
        '<!DOCTYPE interface SYSTEM "../interface.dtd">',
        '<?xml version="1.0" encoding="ISO-8859-1"?>',
    ],
)
def test_usual_heads_are_accepted(head: str) -> None:
    assert parse_bytes(f'{head}<interface name="A">{DATA}</interface>'.encode()).name == "AInterface"


def test_definition_has_values_of_fawkes() -> None:
    schema = parse_bytes(
        definition(
            "<constants>",
            '<constant type="bool" name="YES" value="yes">c</constant>',
            '<constant type="string" name="TEXT" value="a &amp; b">c</constant>',
            '<constant type="float" name="F" value="1.2">c</constant>',
            '<enum name="E"><comment>c</comment><item name="A">c</item>',
            '<item name="B" value="7">c</item><item name="C">c</item></enum>',
            "</constants>",
            "<data><comment>some",
            "  words</comment>",
            '<field type="E" name="mode" unknown="x">c</field>',
            '<field type="string" name="text" length="5" default="abc">c</field>',
            "</data>",
            '<message name="Do"><comment>c</comment>',
            '<ref>text</ref><field type="bool" name="b">c</field></message>',
        )
    )
    assert [constant.value for constant in schema.constants] == [True, "a & b", pytest.approx(1.2, abs=1e-7)]
    assert [item.value for item in schema.enums[0].items] == [0, 7, 8]
    assert schema.comment == "some words"
    assert schema.fields[0].enum is schema.enums[0]
    assert schema.fields[1].default == "abc"
    assert schema.datasize == 32
    # own fields of the message precede its references
    assert [(field.name, field.offset) for field in schema.messages[0].fields] == [("b", 16), ("text", 17)]


def test_ignored_parts_have_warnings() -> None:
    result = check_bytes(
        definition(
            "<comment>c</comment>",
            DATA,
            '<message name="Do">text<commment>c</commment></message>',
            '<message name="Go"><comment>c</comment>',
            '<field type="int8" name="a" lenght="3">c</field></message>',
        )
    )
    assert result.errors == ()
    assert [warning.line for warning in result.warnings] == [2, 4, 4, 6]
    assert "length" in (result.warnings[-1].hint or "")


def test_hash_is_md5_of_bytes(tmp_path: Path) -> None:
    path = tmp_path / "SampleInterface.xml"
    path.write_bytes(definition(DATA))
    schema = parse_file(path)
    assert schema.hash == hashlib.md5(path.read_bytes()).digest()
    assert schema.hash_printable == schema.hash.hex().upper()
    assert schema.source == str(path)


def test_reference_to_invalid_field_has_no_second_error() -> None:
    fields = '<data><comment>c</comment><field type="int33" name="a">c</field></data>'
    message = '<message name="Do"><comment>c</comment><ref>a</ref></message>'
    assert len(check_bytes(definition(fields, message)).errors) == 1


def test_hostile_file_is_parsed_in_bounded_time() -> None:
    started = time.monotonic()
    for part in (
        b"<x/>",
        b'<field type="x">c</field>',
        b"<ref>n</ref>",
        b"<message/>",
        b"&amp;",
        b"<constants>",
    ):
        body = DATA.encode() + b'<message name="M"><comment>c</comment>' + part * (1_000_000 // len(part))
        check_bytes(b'<interface name="A">' + body + b"</message></interface>")
    assert time.monotonic() - started < 8


@given(schemas())
@settings(max_examples=many(60, 25), deadline=None)
def test_schema_is_parsed_from_its_xml(schema: InterfaceSchema) -> None:
    data = schema_xml(schema)
    result = check_bytes(data)
    assert result.errors == ()
    read = result.schema
    assert read is not None
    assert read.hash == hashlib.md5(data).digest()
    for name in ("name", "datasize", "fields", "enums", "constants", "comment"):
        assert getattr(read, name) == getattr(schema, name)
    for message, expected in zip(read.messages, schema.messages, strict=True):
        # own fields of the message precede its references, as in the samples
        assert message == expected


@given(st.binary(max_size=200))
@settings(max_examples=many(150, 37), deadline=None)
def test_random_bytes_never_crash_the_parser(data: bytes) -> None:
    check_bytes(data)
    check_bytes(b"<interface name='A'>" + data)


@given(st.data())
@settings(max_examples=many(250, 62), deadline=None)
def test_mutated_definitions_never_crash_the_parser(draw: st.DataObject) -> None:
    data = bytearray(_WHOLE)
    for _ in range(draw.draw(st.integers(1, 4))):
        place = draw.draw(st.integers(0, len(data)))
        end = min(len(data), place + draw.draw(st.integers(0, 12)))
        data[place:end] = draw.draw(st.one_of(st.binary(max_size=4), st.sampled_from(_SNIPPETS)))
    result = check_bytes(bytes(data))
    assert (result.schema is None) == bool(result.errors)
    assert all(type(error) is InterfaceDefinitionError and error.line for error in result.errors)


_WHOLE = (
    f'<?xml version="1.0"?>{DOCTYPE}<interface name="A" author="B"><constants>'
    '<constant type="int8" name="K" value="1">c</constant>'
    '<enum name="E"><comment>c</comment><item name="I" value="2">c</item></enum></constants>'
    '<data><comment>c</comment><field type="E" name="f" length="3">c</field>'
    '<field type="string" name="s" default="x" flags="changed_indicator">c</field>'
    '<field type="int8" name="g">c</field></data>'
    '<message name="M"><comment>c</comment><ref>g</ref></message></interface>'
).encode()
_SNIPPETS = [
    b"<",
    b">",
    b'"',
    b"&x;",
    b"&#0;",
    b"&#xD800;",
    b"</data>",
    b"<data>",
    b"<!--",
    b"]]>",
    b"<![CDATA[",
    b"name=",
    b"\x00",
    b"<?x?>",
]


def test_definition_in_file_of_another_name_is_mistake(tmp_path: Path) -> None:
    for name in ("ArmInterface.xml", "hand.txt"):
        file = tmp_path / name
        file.write_text(f'<interface name="HandInterface">{DATA}</interface>')
        (error,) = check_file(file).errors
        assert "the file defines HandInterface, not" in error.message
        assert error.hint is not None
        assert "HandInterface.xml" in error.hint
