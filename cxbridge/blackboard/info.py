"""The description of an open interface in a blackboard's list."""

from __future__ import annotations

from msgspec import Struct


class InterfaceInfo(Struct, frozen=True):
    """An open interface.

    :param hash: the hash of the type's definition, 16 bytes, by which Fawkes tells versions apart.
    :param serial: the number of the interface on its blackboard; in Fawkes, of its shared memory.
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
