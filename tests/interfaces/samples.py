"""Definitions for tests, fixed and generated."""

from __future__ import annotations

import json
import string
from collections.abc import Callable
from typing import Any
from xml.sax.saxutils import escape, quoteattr

from hypothesis import strategies as st

from cxbridge.interfaces.block import Block
from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.fieldtypes import TYPES, FieldType
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.layout import make_field, place_fields
from cxbridge.interfaces.names import RESERVED_IN_INTERFACES, RESERVED_IN_MESSAGES
from cxbridge.interfaces.schema import (
    ConstantSchema,
    EnumItem,
    EnumSchema,
    FieldSchema,
    InterfaceSchema,
    MessageSchema,
)
from cxbridge.interfaces.xml.parser import parse_bytes
from tests.support import SHARED

DOCTYPE = '<!DOCTYPE interface SYSTEM "interface.dtd">'
DATA = '<data><comment>c</comment><field type="int32" name="number">c</field></data>'


def scalar_values(*, allow_nan: bool = True) -> dict[str, st.SearchStrategy[Any]]:
    """Return the possible values of each type of numbers and truth values."""
    values: dict[type, Callable[[FieldType], st.SearchStrategy[Any]]] = {
        bool: lambda _: st.booleans(),
        int: lambda field_type: st.integers(*field_type.limits),
        float: lambda field_type: st.floats(width=8 * field_type.size, allow_nan=allow_nan),  # type: ignore[arg-type]
    }
    scalars = [field_type for field_type in TYPES.values() if field_type.python_type is not str]
    return {field_type.name: values[field_type.python_type](field_type) for field_type in scalars}


def definition(*parts: str, name: str = "SampleInterface") -> bytes:
    """Return a definition with the head in line 1 and each part in a separate line."""
    return "\n".join([f'{DOCTYPE}<interface name="{name}">', *parts, "</interface>"]).encode()


def data_block(*fields: str) -> bytes:
    """Return a definition with these fields: field N is in line N + 2, column 1."""
    return definition("<data><comment>c</comment>", *fields, "</data>")


def measured_rows() -> list[dict[str, Any]]:
    """Return the measurements of the real definitions, empty without the measurements."""
    path = SHARED / "compat" / "interfaces.json"
    rows: list[dict[str, Any]] = json.loads(path.read_text()) if path.is_file() else []
    return rows


def bare(interface_class: type[Interface]) -> Any:
    """Return a block of an interface class without a blackboard."""
    block = interface_class.__new__(interface_class)
    Block.__init__(block)
    return block


def block_of(*fields: str, enums: str = "") -> Any:
    """Return a bare block with these fields."""
    constants = f"<constants>{enums}</constants>" if enums else ""
    data = definition(constants, "<data><comment>c</comment>", *fields, "</data>")
    return bare(make_interface_class(parse_bytes(data)))


# -- generated definitions

_WORD = st.text(string.ascii_letters + string.digits + "_", min_size=1, max_size=12)
NAMES = st.builds(lambda head, tail: head + tail, st.sampled_from(string.ascii_letters), _WORD).filter(
    lambda name: name not in RESERVED_IN_INTERFACES | RESERVED_IN_MESSAGES
)
COMMENTS = st.text(
    st.characters(exclude_categories=["Cs", "Cc", "Cn", "Co"], exclude_characters="\ufffe\uffff"),
    min_size=1,
    max_size=30,
).map(lambda text: " ".join(text.split()) or "x")
INT32 = st.integers(-(1 << 31), (1 << 31) - 1)


@st.composite
def enums(draw: st.DrawFn, names: list[str]) -> EnumSchema:
    """Draw an enum, whose names leave the list."""
    numbers = draw(st.lists(INT32, min_size=1, max_size=4, unique=True))
    items = tuple(EnumItem(names.pop(), number, draw(COMMENTS)) for number in numbers)
    return EnumSchema(names.pop(), items, draw(COMMENTS))


@st.composite
def unplaced_fields(draw: st.DrawFn, name: str, enums_of_schema: tuple[EnumSchema, ...]) -> FieldSchema:
    """Draw a field of any type."""
    by_name = {enum.name: enum for enum in enums_of_schema}
    type_name = draw(st.sampled_from([*TYPES, *by_name]))
    length = draw(st.one_of(st.none(), st.integers(1, 9)))
    flags = draw(st.sampled_from([(), ("changed_indicator",)]))
    return make_field(
        name, type_name, length, enum=by_name.get(type_name), comment=draw(COMMENTS), flags=flags
    )


@st.composite
def schemas(draw: st.DrawFn) -> InterfaceSchema:
    """Draw a schema, whose hash is zeros."""
    names = draw(st.lists(NAMES, min_size=30, max_size=30, unique_by=str.lower))
    type_name = draw(NAMES) + "Interface"
    enums_of_schema = tuple(draw(enums(names)) for _ in range(draw(st.integers(0, 2))))
    constants = tuple(
        ConstantSchema(names.pop(), "int16", draw(st.integers(-32768, 32767)), draw(COMMENTS))
        for _ in range(draw(st.integers(0, 2)))
    )
    unplaced = [draw(unplaced_fields(names.pop(), enums_of_schema)) for _ in range(draw(st.integers(1, 6)))]
    fields, datasize = place_fields(unplaced)
    messages = []
    for _ in range(draw(st.integers(0, 2))):
        own = [draw(unplaced_fields(names.pop(), enums_of_schema)) for _ in range(draw(st.integers(0, 2)))]
        refs = draw(st.lists(st.sampled_from(unplaced), unique_by=lambda field: field.name, max_size=2))
        placed, size = place_fields([*own, *refs])
        messages.append(MessageSchema(names.pop() + "Message", size, placed, draw(COMMENTS)))
    return InterfaceSchema(
        type_name,
        bytes(16),
        datasize,
        fields,
        tuple(messages),
        enums_of_schema,
        constants,
        comment=draw(COMMENTS),
    )


def schema_xml(schema: InterfaceSchema) -> bytes:
    """Return the definition of a schema."""
    lines = [DOCTYPE, f"<interface name={quoteattr(schema.name)}>", "<constants>"]
    lines += [
        f'<constant type="{c.type}" name="{c.name}" value="{c.value}">{escape(c.comment)}</constant>'
        for c in schema.constants
    ]
    for enum in schema.enums:
        lines.append(f'<enum name="{enum.name}"><comment>{escape(enum.comment)}</comment>')
        lines += [f'<item value="{i.value}" name="{i.name}">{escape(i.comment)}</item>' for i in enum.items]
        lines.append("</enum>")
    lines.append(f"</constants><data><comment>{escape(schema.comment)}</comment>")
    lines += [_field_xml(field) for field in schema.fields]
    lines.append("</data>")
    for message in schema.messages:
        lines.append(f'<message name="{message.name}"><comment>{escape(message.comment)}</comment>')
        for field in message.fields:
            lines.append(f"<ref>{field.name}</ref>" if schema.field(field.name) else _field_xml(field))
        lines.append("</message>")
    return "\n".join([*lines, "</interface>"]).encode()


def _field_xml(field: FieldSchema) -> str:
    length = "" if field.length is None else f' length="{field.length}"'
    flags = f' flags="{field.flags[0]}"' if field.flags else ""
    return f'<field name="{field.name}"{length} type="{field.type}"{flags}>{escape(field.comment)}</field>'
