"""The memory that the instances of one client may take from a server."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.schema import InterfaceSchema

MOST_INSTANCES: Final = 4096
"""Instances that a client may have open."""

MOST_BYTES: Final = 16 * 1024 * 1024
"""Bytes of the data blocks of these instances together: each instance has a copy of its block."""


def check_room(instances: Iterable[Interface], wanted: InterfaceSchema) -> None:
    """Refuse an instance beyond the limits of a client.

    :raises RemoteRefusalError: when the client has too many instances open, or too large ones.
    """
    sizes = [instance.SCHEMA.datasize for instance in instances]
    if len(sizes) >= MOST_INSTANCES:
        raise RemoteRefusalError(f"a client may have at most {MOST_INSTANCES} interfaces open")
    if sum(sizes) + wanted.datasize > MOST_BYTES:
        raise RemoteRefusalError(f"the interfaces of a client may have {MOST_BYTES} bytes together")
