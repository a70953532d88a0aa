"""The real definitions have the layout of the C++ code of Fawkes' generator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cxbridge.interfaces.classes import make_interface_class
from cxbridge.interfaces.describe import describe_schema_for_json
from cxbridge.interfaces.known_hashes import known_hashes
from cxbridge.interfaces.registry import default_registry
from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema
from cxbridge.interfaces.xml.parser import parse_file
from tests.interfaces.samples import bare, measured_rows
from tests.interfaces.test_known_hashes import OWN
from tests.support import SHARED, needs_shared

ROWS = measured_rows()
BY_NAME = {row["name"]: row for row in ROWS}
SHIPPED = [name for name in default_registry().names() if name not in OWN]

by_row = pytest.mark.parametrize("row", ROWS, ids=[row["name"] for row in ROWS])


def real_schema(row: dict[str, Any]) -> InterfaceSchema:
    return parse_file(SHARED / "fawkes-data" / "interfaces" / Path(row["xml"]).name)


@needs_shared
def test_measurements_have_52_rows() -> None:
    assert len(ROWS) == 52


@by_row
def test_definition_equals_its_row(row: dict[str, Any]) -> None:
    shown = describe_schema_for_json(real_schema(row))
    measured = {key: value for key, value in row.items() if key in shown}
    # describe_schema_for_json has equal values only once
    measured["messages"] = [
        {key: message[key] for key in ("name", "datasize", "fields")} for message in row["messages"]
    ]
    assert set(shown) == {*measured}
    for key, value in measured.items():
        assert shown[key] == value, key
    assert shown["hash"] == row["xml_md5"]
    assert shown["datasize"] == row["sizeof_struct"]
    assert [message["name"] for message in shown["messages"]] == row["messages_runtime"]
    assert [message["datasize"] for message in shown["messages"]] == [
        message["sizeof_struct"] for message in row["messages"]
    ]


@by_row
def test_class_of_definition_has_measured_layout(row: dict[str, Any]) -> None:
    interface = make_interface_class(real_schema(row))
    _check_layout(bare(interface), row)
    for message in row["messages"]:
        _check_layout(interface.MESSAGES[message["name"]](), message)
    for enum in row["enums"]:
        enum_class = getattr(interface, enum["name"])
        assert [(item.name, item.value) for item in enum_class] == [
            (item["name"], item["value"]) for item in enum["items"]
        ]


def _check_layout(block: Any, row: dict[str, Any]) -> None:
    """Set each field in turn; only its bytes are no longer zero."""
    assert len(block.to_bytes()) == row["datasize"]
    for measured in row["fields"]:
        field = block.field(measured["name"])
        block.set(field.name, _full(field))
        data = block.to_bytes()
        place = slice(measured["offset"], measured["offset"] + measured["size"])
        assert any(data[place]), field.name
        assert not any(data[: place.start] + data[place.stop :]), field.name
        block.set_from_chunk(bytes(row["datasize"]))


def _full(field: FieldSchema) -> Any:
    if field.is_string:
        return "x" * (field.runtime_length + 5)
    value = True if field.type == "bool" else 1
    return [value] * field.runtime_length if field.is_array else value


@needs_shared
@pytest.mark.parametrize("name", SHIPPED)
def test_shipped_definition_has_layout_of_fawkes(name: str) -> None:
    shown, row = describe_schema_for_json(default_registry().schema(name)), BY_NAME[name]
    for key in ("datasize", "num_fields", "fields", "enums", "constants"):
        assert shown[key] == row[key], key
    assert shown["messages"] == [
        {key: message[key] for key in ("name", "datasize", "fields")} for message in row["messages"]
    ]


@by_row
def test_known_hashes_equal_rows(row: dict[str, Any]) -> None:
    assert known_hashes(real_schema(row)) == (bytes.fromhex(row["hash"]),)
