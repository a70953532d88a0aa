"""Reading of fields and pseudo maps."""

from __future__ import annotations

from typing import Final

from cxbridge.interfaces.fieldtypes import parse_literal
from cxbridge.interfaces.layout import make_field
from cxbridge.interfaces.names import RESERVED_IN_INTERFACES
from cxbridge.interfaces.schema import EnumSchema, FieldSchema, MapRef, PseudoMapSchema
from cxbridge.interfaces.xml.constants import check_type
from cxbridge.interfaces.xml.findings import Findings, NameScope
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

MAX_DATASIZE: Final = 2 << 20
"""The maximal size of a block in bytes, the default memory of Fawkes' blackboard."""

Enums = dict[str, EnumSchema]
DataFields = dict[str, FieldSchema | None]
"""The data fields by name; None for a field with an error."""

_FLAG = "changed_indicator"
_INTEGERS = ("int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64")
_FIELD_ATTRIBUTES = ("type", "name", "length", "validfor", "default", "flags", "datafield")


def read_field(
    element: Element, enums: Enums, reserved: frozenset[str], scope: NameScope, findings: Findings
) -> FieldSchema | None:
    """Read a ``field`` without its offset, or return None after an error."""
    noted = len(findings.errors)
    findings.only(element, ())
    findings.known_attributes(element, _FIELD_ATTRIBUTES)
    name = findings.name(element, "a field", reserved, "my_field")
    type_name = check_type(element, enums, reserved, findings)
    comment = findings.comment(element, f"field '{name}'" if name else "a field")
    length = _read_length(element, findings)
    attributes = element.attributes
    if attributes.get("validfor") and parse_literal("uint32", attributes["validfor"]) is None:
        findings.error(
            element, f"'{attributes['validfor']}' is not a validity time", "write a number from 0", "validfor"
        )
    if type_name is not None:
        _check_default(element, type_name, findings)
    flags = tuple(flag for flag in attributes.get("flags", "").split(",") if flag)
    for flag in flags:
        if flag != _FLAG:
            findings.error(element, f"unknown flag '{flag}'", f"the only flag is {_FLAG}", "flags")
    if name is not None:
        scope.add(element, "field", name)
    if name is None or type_name is None or len(findings.errors) > noted:
        return None
    field = make_field(
        name,
        type_name,
        length,
        enum=enums.get(type_name),
        comment=comment,
        validfor=attributes.get("validfor"),
        default=attributes.get("default"),
        flags=flags,
    )
    if field.size > MAX_DATASIZE:
        findings.error(
            element,
            f"field '{name}' would take {field.size} bytes, the limit is {MAX_DATASIZE}",
            "give it a shorter length",
            "length",
        )
        return None
    return field


def _read_length(element: Element, findings: Findings) -> int | None:
    """Return the length of an array or string; None without a valid one."""
    text = element.attributes.get("length")
    if not text:
        return None
    length = parse_literal("uint32", text)
    if not isinstance(length, int) or length == 0:
        findings.error(
            element,
            f"'{text}' is not a length",
            "write the number of elements (of bytes for a string, one more than its text), at least 1",
            "length",
        )
        return None
    return length


def _check_default(element: Element, type_name: str, findings: Findings) -> None:
    """Report an invalid default."""
    text = element.attributes.get("default")
    if text and parse_literal(type_name, text) is None:
        findings.error(
            element,
            f"'{text}' is not a default for type {type_name}",
            "leave it out: defaults are checked and never used, blocks begin as zeros",
            "default",
        )


def read_pseudomap(
    element: Element, fields: DataFields, enums: Enums, scope: NameScope, findings: Findings
) -> PseudoMapSchema | None:
    """Read a ``pseudomap`` over data fields, or return None after an error."""
    noted = len(findings.errors)
    findings.only(element, ("comment", "mapref"))
    findings.known_attributes(element, ("type", "keytype", "name"))
    name = findings.name(element, "a pseudo map", RESERVED_IN_INTERFACES, "values")
    subject = f"pseudo map '{name}'" if name else "a pseudo map"
    type_name = check_type(element, enums, RESERVED_IN_INTERFACES, findings)
    keytype = findings.attribute(element, "keytype", "uint32")
    if keytype is not None and keytype not in _INTEGERS:
        findings.error(
            element,
            f"the keys of {subject} cannot be of type '{keytype}'",
            f"use {', '.join(_INTEGERS)}",
            "keytype",
        )
        keytype = None
    comment = findings.loose_comment(element, subject)
    maprefs = element.find_all("mapref")
    if not maprefs:
        findings.error(element, f"{subject} has no entries", 'add <mapref key="1">name_of_a_field</mapref>')
    refs: dict[int, MapRef] = {}
    for mapref in maprefs:
        entry = _read_mapref(mapref, keytype, fields, findings)
        if entry is None:
            continue
        if entry[0] in refs:
            findings.error(mapref, f"{subject} has the key {entry[0]} twice", "use every key once", "key")
        refs[entry[0]] = entry[1]
    if name is not None:
        scope.add(element, "pseudo map", name)
    if name is None or type_name is None or keytype is None or len(findings.errors) > noted:
        return None
    return PseudoMapSchema(name, type_name, keytype, tuple(refs.values()), comment)


def _read_mapref(
    element: Element, keytype: str | None, fields: DataFields, findings: Findings
) -> tuple[int, MapRef] | None:
    findings.only(element, ())
    text = findings.attribute(element, "key", "1")
    key = parse_literal(keytype or "int64", text) if text is not None else None
    if text is not None and not isinstance(key, int):
        findings.error(element, f"'{text}' is not a key of type {keytype}", "write a number", "key")
    field = find_field(element, fields, findings)
    if field is not None and field.length is not None:
        findings.error(
            element,
            f"a pseudo map cannot refer to '{field.name}', which has a length",
            "refer to fields with a single value only",
        )
        return None
    if field is None or not isinstance(key, int):
        return None
    return key, MapRef(field.name, text or "")


def find_field(element: Element, fields: DataFields, findings: Findings) -> FieldSchema | None:
    """Return the data field that an element names; report it if there is none."""
    name = element.text
    if name not in fields:
        if name.strip() in fields:
            hint = f"write <{element.name}>{name.strip()}</{element.name}> without blanks"
        else:
            hint = did_you_mean(name.strip(), fields, f"the data fields are {', '.join(fields) or 'none'}")
        findings.error(element, f"there is no data field '{name.strip()}' to refer to", hint)
    return fields.get(name)
