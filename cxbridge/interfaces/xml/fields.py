"""Reads the fields and pseudo maps of an interface definition."""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.fieldtypes import parse_literal
from cxbridge.interfaces.layout import make_field
from cxbridge.interfaces.names import RESERVED_IN_INTERFACES
from cxbridge.interfaces.schema import EnumSchema, FieldSchema, MapRef, PseudoMapSchema
from cxbridge.interfaces.xml.constants import read_type
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

MAX_DATASIZE: Final = 2 << 20
"""The maximum size of a block in bytes, the default memory of Fawkes' blackboard."""

Enums = dict[str, EnumSchema]
DataFields = dict[str, FieldSchema | None]
"""The data fields by name. A field with an error is None, so that references to it report no second error."""

_CHANGED_INDICATOR = "changed_indicator"
_KEY_TYPES = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
_FIELD_ATTRIBUTES = ("type", "name", "length", "validfor", "default", "flags", "datafield")


def read_field(
    element: Element, enums: Enums, reserved: frozenset[str], scope: NameScope, findings: Findings
) -> FieldSchema:
    """Read a ``field`` without its offset.

    :raises InterfaceDefinitionError: if it is invalid.
    """
    findings.check_form(element, _FIELD_ATTRIBUTES)
    name = findings.read_name(element, "a field", reserved, "my_field")
    scope.add(element, "field", name)
    comment = findings.read_comment(element, f"field '{name}'")
    type_name = read_type(element, enums, reserved, findings)
    attributes = element.attributes
    _check_literal(element, "validfor", "uint32", "is not a validity time", "write a number from 0", findings)
    _check_literal(
        element,
        "default",
        type_name,
        f"is not a default for type {type_name}",
        "omit it: defaults are checked but never used, and blocks begin as zeros",
        findings,
    )
    flags = tuple(flag for flag in attributes.get("flags", "").split(",") if flag)
    for flag in flags:
        if flag != _CHANGED_INDICATOR:
            raise findings.make_error(
                element, f"unknown flag '{flag}'", f"the only flag is {_CHANGED_INDICATOR}", "flags"
            )
    field = make_field(
        name,
        type_name,
        _read_length(element, findings),
        enum=enums.get(type_name),
        comment=comment,
        validfor=attributes.get("validfor"),
        default=attributes.get("default"),
        flags=flags,
    )
    if field.size > MAX_DATASIZE:
        raise findings.make_error(
            element,
            f"field '{name}' would take {field.size} bytes, more than the limit of {MAX_DATASIZE}",
            "give it a shorter length",
            "length",
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
            "length",
        )
    return length


def _check_literal(
    element: Element, attribute: str, type_name: str, problem: str, hint: str, findings: Findings
) -> None:
    """Check an optional attribute, which Fawkes checks but does not use."""
    text = element.attributes.get(attribute)
    if text and parse_literal(type_name, text) is None:
        raise findings.make_error(element, f"'{text}' {problem}", hint, attribute)


def read_pseudomap(
    element: Element, fields: DataFields, enums: Enums, scope: NameScope, findings: Findings
) -> PseudoMapSchema:
    """Read a ``pseudomap`` over data fields.

    :raises InterfaceDefinitionError: if it is invalid.
    """
    findings.check_form(element, ("type", "keytype", "name"), ("comment", "mapref"))
    name = findings.read_name(element, "a pseudo map", RESERVED_IN_INTERFACES, "values")
    scope.add(element, "pseudo map", name)
    subject = f"pseudo map '{name}'"
    comment = findings.read_comment_child(element, subject, allows_text=True)
    type_name = read_type(element, enums, RESERVED_IN_INTERFACES, findings)
    keytype = findings.read_attribute(element, "keytype", "uint32")
    if keytype not in _KEY_TYPES:
        hint = f"use {', '.join(_KEY_TYPES)}"
        raise findings.make_error(
            element, f"the keys of {subject} cannot be of type '{keytype}'", hint, "keytype"
        )
    maprefs = element.find_all("mapref")
    if not maprefs:
        findings.report_error(
            element, f"{subject} has no entries", 'add <mapref key="1">name_of_a_field</mapref>'
        )
    refs: dict[int, MapRef] = {}
    for mapref in maprefs:
        with findings.collecting_error():  # the other entries can still be checked
            key, ref = _read_mapref(mapref, keytype, fields, findings)
            if key in refs:
                raise findings.make_error(
                    mapref, f"{subject} has the key {key} twice", "use every key once", "key"
                )
            refs[key] = ref
    return PseudoMapSchema(name, type_name, keytype, tuple(refs.values()), comment)


def _read_mapref(
    element: Element, keytype: str, fields: DataFields, findings: Findings
) -> tuple[int, MapRef]:
    """Return the key and the entry of a ``mapref``."""
    findings.check_form(element, ("key",))
    text = findings.read_attribute(element, "key", "1")
    key = parse_literal(keytype, text)
    if not isinstance(key, int):
        raise findings.make_error(
            element, f"'{text}' is not a key of type {keytype}", "write a number", "key"
        )
    field = find_field(element, fields, findings)
    if field is not None and field.length is not None:
        raise findings.make_error(
            element,
            f"a pseudo map cannot refer to '{field.name}', which has a length",
            "refer only to fields with a single value",
        )
    return key, MapRef(element.text, text)


def find_field(element: Element, fields: DataFields, findings: Findings) -> FieldSchema | None:
    """Return the data field that an element names; None if the field has an error.

    :raises InterfaceDefinitionError: if there is no such field.
    """
    name = element.text
    if name in fields:
        return fields[name]
    # Fawkes compares the text with its spaces
    if name.strip() in fields:
        hint = f"write <{element.name}>{name.strip()}</{element.name}> without spaces"
    else:
        hint = did_you_mean(name.strip(), fields, f"the data fields are {', '.join(fields) or 'none'}")
    raise findings.make_error(element, f"there is no data field '{name.strip()}' to refer to", hint)
