"""Hashes of Fawkes' interface types whose layout equals that of a definition of cxbridge.

Fawkes identifies the version of an interface by the MD5 of the definition file: another file with the same
layout counts as another version. If the layouts are equal, cxbridge can safely use Fawkes' hash. The table
``interfaces/known-hashes.json`` maps type names and fingerprints of layouts to hashes of Fawkes (commit
649cec084).
"""

from __future__ import annotations

import hashlib
import json
from functools import cache
from typing import Any

from cxbridge.interfaces.schema import FieldSchema, InterfaceSchema
from cxbridge.interfaces.xml.parser import parse_file
from cxbridge.resources import shipped_dir

TABLE_NAME = "known-hashes.json"
"""The name of the table's file, among the shipped definitions."""


def layout_fingerprint(schema: InterfaceSchema) -> str:
    """Return a digest of everything that two programs must agree on, as 64 hexadecimal digits.

    The digest covers the names and sizes of the type and its messages; name, type, length, offset and size of
    their fields; and the names and values of enums. The digest does not cover comments, constants, defaults
    and authors.
    """
    layout = {
        "name": schema.name,
        "datasize": schema.datasize,
        "fields": _list_layout(schema.fields),
        "messages": [
            [message.name, message.datasize, _list_layout(message.fields)] for message in schema.messages
        ],
        "enums": [[enum.name, [(item.name, item.value) for item in enum.items]] for enum in schema.enums],
    }
    return hashlib.sha256(json.dumps(layout, separators=(",", ":")).encode()).hexdigest()


def known_hashes(schema: InterfaceSchema) -> tuple[bytes, ...]:
    """Return the 16-byte hashes that Fawkes has for this layout."""
    hashes_by_fingerprint = _load_table().get(schema.name, {})
    hashes = hashes_by_fingerprint.get(layout_fingerprint(schema), ())
    return tuple(map(bytes.fromhex, hashes))


def hash_for_wire(schema: InterfaceSchema) -> bytes:
    """Return the hash to send to Fawkes: the first known hash of this layout, else that of the definition."""
    return next(iter(known_hashes(schema)), schema.hash)


def accepts_hash(schema: InterfaceSchema, remote_hash: bytes) -> bool:
    """Return whether a received hash belongs to this definition or to a known definition of equal layout.

    The known definitions are those of Fawkes, and the definition that cxbridge ships.
    """
    if remote_hash == schema.hash or remote_hash in known_hashes(schema):
        return True
    # a copy of the shipped definition may have other comments
    shipped = _read_shipped_version(schema.name)
    return shipped is not None and shipped == (remote_hash, layout_fingerprint(schema))


def _list_layout(fields: tuple[FieldSchema, ...]) -> list[list[Any]]:
    """Return the properties of fields that affect the layout."""
    return [[field.name, field.type, field.length, field.offset, field.size] for field in fields]


@cache
def _read_shipped_version(name: str) -> tuple[bytes, str] | None:
    """Return hash and fingerprint of the shipped definition of a type; None without a definition."""
    path = shipped_dir("interfaces") / f"{name}.xml"
    if not path.is_file():
        return None
    schema = parse_file(path)
    return schema.hash, layout_fingerprint(schema)


@cache
def _load_table() -> dict[str, dict[str, list[str]]]:
    """Return the hexadecimal hashes by type name and fingerprint."""
    table_json = (shipped_dir("interfaces") / TABLE_NAME).read_text(encoding="utf-8")
    table: dict[str, dict[str, list[str]]] = json.loads(table_json)
    return table
