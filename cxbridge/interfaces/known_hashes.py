"""The hashes that a real Fawkes has for interface types whose layout is ours.

Fawkes distinguishes versions of an interface by the MD5 of the definition file, so a definition of equal
layout in other words is another version to it. Where the layout is proven equal, it is safe to use Fawkes'
hash instead; where it is not, never. The table ``interfaces/known-hashes.json`` maps a type's name and the
fingerprint of its layout to the hashes that Fawkes (commit 649cec084) has for it.
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


def layout_fingerprint(schema: InterfaceSchema) -> str:
    """Return a digest of all that two sides must agree on, as 64 hexadecimal digits.

    That is the type's name and size; name, type, length, offset and size of each field; the messages
    likewise; and the enums with their numbers. Comments, constants, defaults and the author make no
    difference.
    """
    layout = {
        "name": schema.name,
        "datasize": schema.datasize,
        "fields": _fields(schema.fields),
        "messages": [[one.name, one.datasize, _fields(one.fields)] for one in schema.messages],
        "enums": [[one.name, [(item.name, item.value) for item in one.items]] for one in schema.enums],
    }
    return hashlib.sha256(json.dumps(layout, separators=(",", ":")).encode()).hexdigest()


def known_hashes(schema: InterfaceSchema) -> tuple[bytes, ...]:
    """Return the hashes (16 bytes each) that Fawkes has for exactly this layout; none when it is unknown."""
    entry = _table().get(schema.name, {})
    return tuple(bytes.fromhex(text) for text in entry.get(layout_fingerprint(schema), ()))


def hash_for_wire(schema: InterfaceSchema) -> bytes:
    """Return the hash to offer to a Fawkes: one that it knows for this layout, else the definition's own."""
    return next(iter(known_hashes(schema)), schema.hash)


def accepts_hash(schema: InterfaceSchema, remote: bytes) -> bool:
    """Return whether a hash from elsewhere stands for this definition or for a known one of equal layout.

    Known are Fawkes' and, to who uses Fawkes' definitions, the one that comes with cxbridge.
    """
    if remote == schema.hash or remote in known_hashes(schema):
        return True
    shipped = _shipped(schema.name)
    return shipped is not None and shipped == (remote, layout_fingerprint(schema))


def _fields(fields: tuple[FieldSchema, ...]) -> list[list[Any]]:
    """Return what counts of fields."""
    return [[field.name, field.type, field.length, field.offset, field.size] for field in fields]


@cache
def _shipped(name: str) -> tuple[bytes, str] | None:
    """Return hash and fingerprint of the definition that comes with cxbridge, None when there is none."""
    path = shipped_dir("interfaces") / f"{name}.xml"
    if not path.is_file():
        return None
    schema = parse_file(path)
    return schema.hash, layout_fingerprint(schema)


@cache
def _table() -> dict[str, dict[str, list[str]]]:
    """Return the table: type name, then fingerprint, then hashes as hexadecimal digits."""
    text = (shipped_dir("interfaces") / TABLE_NAME).read_text(encoding="utf-8")
    table: dict[str, dict[str, list[str]]] = json.loads(text)
    return table
