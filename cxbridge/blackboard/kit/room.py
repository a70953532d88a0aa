"""Limits of the memory that the instances of one client take at a server."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.blackboard.kit.errors import RemoteRefusalError
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.schema import InterfaceSchema

MOST_INSTANCES: Final = 4096

# each open instance has a copy of its data block in the server's memory
MOST_BYTES: Final = 16 * 1024 * 1024


def check_room(instances: Iterable[Interface], wanted: InterfaceSchema) -> None:
    """Check that a client may open one more instance.

    :raises RemoteRefusalError: if the client has too many instances open, or too many bytes.
    """
    sizes = [instance.SCHEMA.datasize for instance in instances]
    if len(sizes) >= MOST_INSTANCES:
        raise RemoteRefusalError(f"a client may have at most {MOST_INSTANCES} interfaces open")
    if sum(sizes) + wanted.datasize > MOST_BYTES:
        raise RemoteRefusalError(f"the interfaces of a client may have {MOST_BYTES} bytes together")
