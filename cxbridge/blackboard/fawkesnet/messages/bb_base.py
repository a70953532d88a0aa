"""What the messages of the blackboard component have in common. Source: docs/protocol-fawkes.md."""

from __future__ import annotations

from enum import IntEnum
from struct import Struct
from typing import ClassVar, Final

from cxbridge.blackboard.fawkesnet.messages.fields import Value
from cxbridge.blackboard.fawkesnet.messages.frames import Component

TYPE_SIZE: Final = 48
ID_SIZE: Final = 64
MESSAGE_TYPE_SIZE: Final = 64
HASH_SIZE: Final = 16

NAMES: Final = Struct(f"{TYPE_SIZE}s{ID_SIZE}s")
"""Type and id of an interface."""

_HAS_WRITER: Final = 1 << 31


class Kind(IntEnum):
    """Kinds of messages of the blackboard component."""

    LIST_ALL = 0
    INTERFACE_LIST = 1
    OPEN_FOR_READING = 2
    OPEN_FOR_WRITING = 3
    OPEN_SUCCESS = 4
    OPEN_FAILURE = 5
    CLOSE = 6
    WRITE = 7
    INTERFACE_MESSAGE = 8
    DATA_REFRESHED = 9
    DATA_CHANGED = 10
    READER_ADDED = 11
    READER_REMOVED = 12
    WRITER_ADDED = 13
    WRITER_REMOVED = 14
    INTERFACE_CREATED = 15
    INTERFACE_DESTROYED = 16
    LIST = 17


class OpenError(IntEnum):
    """Why an interface cannot be opened."""

    UNKNOWN = 0
    UNKNOWN_TYPE = 1
    HASH_MISMATCH = 2
    WRITER_EXISTS = 3


class BlackBoardValue(Value):
    """What the messages of the blackboard component have in common."""

    __slots__ = ()
    COMPONENT: ClassVar[Component] = Component.BLACKBOARD

    @property
    def message_kind(self) -> int:
        """Return the number of the message within its component."""
        kind: Kind = self.kind  # type: ignore[attr-defined] # of the class, of the value or made of it
        return kind


def pack_presence(has_writer: bool, num_readers: int) -> int:
    """Return the word that tells whether there is a writer and how many readers there are."""
    return (_HAS_WRITER if has_writer else 0) | min(num_readers, _HAS_WRITER - 1)


def unpack_presence(word: int) -> tuple[bool, int]:
    """Return whether there is a writer, and the number of readers."""
    return bool(word & _HAS_WRITER), word & ~_HAS_WRITER
