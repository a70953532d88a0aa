"""Hashes of interface types for Fawkes and its clients.

Fawkes refuses to open an interface with another hash than its own, and its hash is that of the definition's
bytes. So a client offers the hashes of all definitions with the same layout, and a server shows Fawkes' hash.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.blackboard.base import Registry
from cxbridge.errors import InterfaceError
from cxbridge.interfaces.known_hashes import accepts_hash, hash_for_wire, known_hashes
from cxbridge.interfaces.schema import InterfaceSchema


class RemoteHashes:
    """The hashes accepted by one server. Thread-safe, because entries are only added."""

    def __init__(self) -> None:
        self._adopted: Final[dict[str, bytes]] = {}

    def candidates(self, schema: InterfaceSchema, listed: Iterable[bytes] = ()) -> list[bytes]:
        """Return the hashes to offer, most likely first."""
        adopted = self._adopted.get(schema.name)
        likely = [] if adopted is None or not accepts_hash(schema, adopted) else [adopted]
        likely += [hash_ for hash_ in listed if accepts_hash(schema, hash_)]
        likely += known_hashes(schema) or (schema.hash,)
        return list(dict.fromkeys(likely))

    def adopt(self, schema: InterfaceSchema, accepted: bytes) -> None:
        """Remember a hash that the server accepted."""
        self._adopted[schema.name] = accepted


def local_hash(registry: Registry, interface_type: str, remote: bytes) -> bytes:
    """Return cxbridge's hash of a type if the server's hash is equivalent; else the server's hash."""
    schema = schema_or_none(registry, interface_type)
    return schema.hash if schema is not None and accepts_hash(schema, remote) else remote


def fawkes_hash(registry: Registry, interface_type: str, in_memory: bytes) -> bytes:
    """Return Fawkes' hash of an open interface if Fawkes has the same layout; else the present hash."""
    schema = schema_or_none(registry, interface_type)
    return hash_for_wire(schema) if schema is not None and schema.hash == in_memory else in_memory


def schema_or_none(registry: Registry, interface_type: str) -> InterfaceSchema | None:
    """Return the schema of a type; None if it is unknown or its definition is wrong."""
    try:
        return registry.get(interface_type).SCHEMA
    except InterfaceError:
        return None
