"""Reading of the fields of an interface definition, and of references to data fields."""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.fieldtypes import TYPES, parse_literal
from cxbridge.interfaces.layout import make_field
from cxbridge.interfaces.schema import EnumSchema, FieldSchema
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import Element

MAX_DATASIZE: Final = 2 << 20
"""The maximum size of a block in bytes, the default memory of Fawkes' blackboard."""

Enums = dict[str, EnumSchema]
DataFields = dict[str, FieldSchema | None]
"""The data fields by name. A field with an error is None, so that references to it report no second error."""

_FIELD_ATTRIBUTES = ("type", "name", "length", "validfor", "default", "flags", "datafield")


def read_field(
    element: Element, enums: Enums, reserved_names: frozenset[str], scope: NameScope, findings: Findings
) -> FieldSchema:
    """Read a ``field`` without its offset.

    :raises InterfaceDefinitionError: if the field is invalid.
    """
    findings.check_form(element, _FIELD_ATTRIBUTES)
    name = findings.read_name(element, reserved_names)
    scope.add(element, name)
    comment = findings.read_comment(element)
    type_name = findings.read_attribute(element, "type")
    if type_name not in TYPES and type_name not in enums:
        raise findings.make_error(
            element,
            f"unknown type '{type_name}'",
            f"use one of {', '.join(TYPES)}, or an <enum> of the <constants> of this file",
        )
    field = make_field(
        name,
        type_name,
        _read_length(element, findings),
        enum=enums.get(type_name),
        comment=comment,
        default=element.attributes.get("default"),
        flags=tuple(flag for flag in element.attributes.get("flags", "").split(",") if flag),
    )
    if field.size > MAX_DATASIZE:
        raise findings.make_error(
            element, f"field '{name}' would take {field.size} bytes, more than the limit of {MAX_DATASIZE}"
        )
    return field


def _read_length(element: Element, findings: Findings) -> int | None:
    """Return the length of an array or string; None for a single value."""
    text = element.attributes.get("length")
    if not text:
        return None
    length = parse_literal("uint32", text)
    if not isinstance(length, int) or length == 0:
        raise findings.make_error(
            element,
            f"'{text}' is not a length",
            "write the positive number of elements; for a string, its bytes plus one",
        )
    return length


def find_field(element: Element, fields: DataFields, findings: Findings) -> FieldSchema | None:
    """Return the data field that an element names; None if the field has an error.

    :raises InterfaceDefinitionError: if there is no such field.
    """
    # Fawkes compares the text with its spaces
    if element.text not in fields:
        raise findings.make_error(element, f"there is no data field '{element.text}' to refer to")
    return fields[element.text]
