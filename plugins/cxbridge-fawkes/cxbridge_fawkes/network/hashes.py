"""Hashes of interface types for Fawkes and its clients.

The hash of a type is the MD5 of its XML definition. Fawkes refuses to open an interface with a hash that
differs from the hash of Fawkes' definition, even if both definitions have the same layout. So a client offers
the hashes of all known definitions with the same layout, and a server shows the hash of Fawkes' definition.
"""

from __future__ import annotations

from collections.abc import Iterable

from cxbridge.blackboard.base import Registry
from cxbridge.errors import InterfaceError
from cxbridge.interfaces.known_hashes import accepts_hash, hash_for_wire, known_hashes
from cxbridge.interfaces.schema import InterfaceSchema


def candidate_hashes(schema: InterfaceSchema, listed_hashes: Iterable[bytes] = ()) -> list[bytes]:
    """Return the hashes to offer to a server, most likely first.

    :param listed_hashes: the hashes in the server's list of the type's interfaces.
    """
    candidates = [hash_ for hash_ in listed_hashes if accepts_hash(schema, hash_)]
    return list(dict.fromkeys([*candidates, *(known_hashes(schema) or (schema.hash,))]))


def local_hash(registry: Registry, interface_type: str, remote_hash: bytes) -> bytes:
    """Return cxbridge's hash of a type if the server's hash is equivalent; else the server's hash."""
    schema = find_schema(registry, interface_type)
    return schema.hash if schema is not None and accepts_hash(schema, remote_hash) else remote_hash


def fawkes_hash(registry: Registry, interface_type: str, open_hash: bytes) -> bytes:
    """Return Fawkes' hash of an open interface.

    :param open_hash: the hash of the open interface; returned if Fawkes' layout differs or is unknown, or if
        the registry has another definition of the type.
    """
    schema = find_schema(registry, interface_type)
    return hash_for_wire(schema) if schema is not None and schema.hash == open_hash else open_hash


def find_schema(registry: Registry, interface_type: str) -> InterfaceSchema | None:
    """Return the schema of a type; None if the type is unknown or its definition is wrong."""
    try:
        return registry.get(interface_type).SCHEMA
    except InterfaceError:
        return None
