"""Comparison of messages with Foxglove's published schemas (foxglove-schemas-protobuf)."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import Any, Final

import pytest

_STAMPS: Final = {"google.protobuf.Timestamp", "google.protobuf.Duration"}
_KINDS: Final = {"string": {9}, "boolean": {8}, "number": {1, 2}, "integer": {5, 6, 7, 13, 14}}
"""The numbers of protobuf's field types (descriptor.proto) by JSON type."""


def descriptor(message: str) -> Any:
    """Return the published descriptor of a message, e.g. of ``Log``."""
    pytest.importorskip("foxglove_schemas_protobuf", reason="needs foxglove-schemas-protobuf")
    module = import_module(f"foxglove_schemas_protobuf.{message}_pb2")
    return getattr(module, message).DESCRIPTOR


def check_schema(schema: Mapping[str, Any], published: Any) -> None:
    """Assert that a JSON schema has the fields and types of a published message."""
    fields = {field.name: field for field in published.fields}
    assert set(schema["properties"]) == set(schema["required"]) == set(fields), published.full_name
    for name, field_schema in schema["properties"].items():
        field = fields[name]
        if field.is_repeated:
            assert field_schema["type"] == "array", name
            field_schema = field_schema["items"]  # noqa: PLW2901 - the schema of an item
        if field.message_type is None:
            _check_scalar(field_schema, field)
        elif field.message_type.full_name in _STAMPS:
            assert set(field_schema["properties"]) == {"sec", "nsec"}, name
        else:
            check_schema(field_schema, field.message_type)


def _check_scalar(field_schema: Mapping[str, Any], field: Any) -> None:
    if field.type == field.TYPE_BYTES:
        assert field_schema == {"type": "string", "contentEncoding": "base64"}
    else:
        assert field.type in _KINDS[field_schema["type"]], field.full_name


def check_message(message: str, data: Mapping[str, Any]) -> Any:
    """Return a message as an object of the published class, which refuses unknown fields and types."""
    published = descriptor(message)
    module = import_module(f"foxglove_schemas_protobuf.{message}_pb2")
    parse = import_module("google.protobuf.json_format").ParseDict
    return parse(_to_protobuf_json(data, published), getattr(module, message)())


def _to_protobuf_json(data: Any, published: Any) -> dict[str, Any]:
    """Return the JSON of protobuf, in which times are texts."""
    fields = {field.name: field for field in published.fields}
    assert set(data) == set(fields), f"{published.full_name} has different fields"
    return {name: _to_field_json(value, fields[name]) for name, value in data.items()}


def _to_field_json(value: Any, field: Any) -> Any:
    """Return the JSON of a field's value, which may be a list of messages."""
    if field.message_type is None:
        return value
    if isinstance(value, list):
        return [_to_message_json(item, field.message_type) for item in value]
    return _to_message_json(value, field.message_type)


def _to_message_json(value: Any, published: Any) -> Any:
    """Return the JSON of a message, or the text of a time."""
    if published.full_name not in _STAMPS:
        return _to_protobuf_json(value, published)
    assert set(value) == {"sec", "nsec"}
    assert 0 <= value["nsec"] < 10**9
    if published.full_name.endswith("Duration"):
        return f"{value['sec']}.{value['nsec']:09}s"
    timestamp = import_module("google.protobuf.timestamp_pb2").Timestamp
    return str(timestamp(seconds=value["sec"], nanos=value["nsec"]).ToJsonString())
