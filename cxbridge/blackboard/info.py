"""The description of an open interface in a blackboard's list."""

from __future__ import annotations

from msgspec import Struct


class InterfaceInfo(Struct, frozen=True):
    """An open interface.

    :param hash: the version of the type, 16 bytes.
    :param serial: the number of the shared memory on its blackboard.
    :param writer: the writer's owner; empty without writer.
    :param readers: the readers' owners in order of opening.
    :param timestamp_us: the block's time stamp, microseconds since the epoch; 0 before the first write.
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
        return len(self.readers)
