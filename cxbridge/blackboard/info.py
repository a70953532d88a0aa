"""The description of an open interface, as blackboards list it."""

from __future__ import annotations

from msgspec import Struct


class InterfaceInfo(Struct, frozen=True):
    """The description of an open interface by a blackboard.

    :param hash: version of the type, 16 bytes.
    :param serial: number of the shared memory, unique on its blackboard.
    :param writer: the writer's owner; empty when there is none.
    :param readers: the readers' owners, in the order of opening.
    :param timestamp_us: time stamp of the shared block, microseconds since the epoch; 0 before a write.
    """

    type: str
    id: str
    hash: bytes
    serial: int
    has_writer: bool
    writer: str
    readers: tuple[str, ...]
    timestamp_us: int

    @property
    def uid(self) -> str:
        """``Type::id``."""
        return f"{self.type}::{self.id}"

    @property
    def num_readers(self) -> int:
        """How many have it open for reading."""
        return len(self.readers)
