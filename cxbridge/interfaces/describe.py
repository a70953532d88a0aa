"""Descriptions of schemas as text and JSON, for ``cxbridge interface show``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cxbridge.interfaces.fieldtypes import TYPES
from cxbridge.interfaces.known_hashes import known_hashes
from cxbridge.interfaces.schema import ConstantSchema, FieldSchema, InterfaceSchema, MessageSchema


def describe_schema_for_json(schema: InterfaceSchema) -> dict[str, Any]:
    """Return a schema as an object for JSON: hash, sizes, fields, messages, enums and constants.

    A ``float`` has the nine digits of ``printf("%.9g")``, which distinguish all 32-bit floats.
    """
    return {
        "name": schema.name,
        "hash": schema.hash.hex(),
        "hash_printable": schema.hash_printable,
        "datasize": schema.datasize,
        "num_fields": len(schema.fields),
        "fields": [_data_field_object(field) for field in schema.fields],
        "messages": [_message_object(message) for message in schema.messages],
        "enums": [
            {"name": enum.name, "items": [{"name": item.name, "value": item.value} for item in enum.items]}
            for enum in schema.enums
        ],
        "constants": [
            {"name": constant.name, "type": constant.type, "value": _constant_for_json(constant)}
            for constant in schema.constants
        ],
    }


def _field_object(field: FieldSchema) -> dict[str, Any]:
    """Return a field for JSON; flags and default only if the definition has them."""
    values: dict[str, Any] = {"name": field.name, "type": field.type, "length": field.length}
    if field.flags:
        values["flags"] = ",".join(field.flags)
    if field.default is not None:
        values["default"] = field.default
    return values | {"offset": field.offset, "size": field.size, "elem_size": field.elem_size}


def _data_field_object(field: FieldSchema) -> dict[str, Any]:
    """Return a data field for JSON, with the results of Fawkes' introspection."""
    return _field_object(field) | {
        "rt_type": field.type,
        "rt_length": field.runtime_length,
        "rt_is_enum": field.is_enum,
    }


def _message_object(message: MessageSchema) -> dict[str, Any]:
    return {
        "name": message.name,
        "datasize": message.datasize,
        "fields": [_field_object(field) for field in message.fields],
    }


def _constant_for_json(constant: ConstantSchema) -> bool | int | float | str:
    constant_type = TYPES[constant.type]
    if constant_type.python_type is float:
        return float(f"{constant_type.round(float(constant.value)):.{constant_type.digits}g}")
    return constant.value


def describe_schema(schema: InterfaceSchema) -> Iterator[str]:
    """Yield lines that describe a schema."""
    yield f"{schema.name}: {schema.datasize} bytes, hash {schema.hash_printable}"
    hashes = known_hashes(schema)
    # the shipped files differ from Fawkes' in comments, and so in their hashes
    if hashes and schema.hash not in hashes:
        yield f"  Fawkes knows this layout as {', '.join(hash_.hex().upper() for hash_ in hashes)}"
    if schema.comment:
        yield f"  {schema.comment}"
    if schema.source:
        yield f"  from {schema.source}"
    for constant in schema.constants:
        yield f"  constant {constant.type} {constant.name} = {constant.value!r}"
    for enum in schema.enums:
        items = ", ".join(f"{item.name}={item.value}" for item in enum.items)
        yield f"  enum {enum.name}: {items}"
    yield from _describe_fields(schema.fields, "  ")
    for message in schema.messages:
        yield f"  message {message.name}: {message.datasize} bytes"
        yield from _describe_fields(message.fields, "    ")


def _describe_fields(fields: tuple[FieldSchema, ...], indent: str) -> Iterator[str]:
    """Yield a line per field: offset, size, type and name."""
    for field in fields:
        length = "" if field.length is None else f"[{field.length}]"
        yield f"{indent}{field.offset:6d} {field.size:5d}  {field.type}{length} {field.name}"
