"""Messages of the blackboard component about lists of interfaces. Source: docs/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct
from typing import ClassVar, Final, Self

from cxbridge.blackboard.fawkesnet.messages.bb_base import (
    HASH_SIZE,
    ID_SIZE,
    NAMES,
    TYPE_SIZE,
    BlackBoardValue,
    Kind,
    pack_presence,
    unpack_presence,
)
from cxbridge.blackboard.fawkesnet.messages.fields import (
    expect_size,
    pack_list,
    pack_text,
    unpack_list,
    unpack_text,
)
from cxbridge.clock import join_us, split_us

_INFO_HEAD: Final = Struct(f">{TYPE_SIZE}s{ID_SIZE}s{HASH_SIZE}sII")
_INFO_STAMP: Final = Struct("=qq")


@dataclass(frozen=True, slots=True)
class ListAll(BlackBoardValue):
    """Asks for all interfaces."""

    kind: ClassVar[Kind] = Kind.LIST_ALL

    def pack(self) -> bytes:
        """Return the payload."""
        return b""

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        expect_size(payload, 0, "LIST_ALL")
        return cls()


@dataclass(frozen=True, slots=True)
class ListMatching(BlackBoardValue):
    """Asks for the interfaces that match two shell patterns."""

    type_pattern: str
    id_pattern: str
    kind: ClassVar[Kind] = Kind.LIST

    def pack(self) -> bytes:
        """Return the payload."""
        type_pattern = pack_text(self.type_pattern, TYPE_SIZE, terminated=False)
        return type_pattern + pack_text(self.id_pattern, ID_SIZE, terminated=False)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        expect_size(payload, NAMES.size, "LIST")
        return cls(*map(unpack_text, NAMES.unpack(payload)))


@dataclass(frozen=True, slots=True)
class Info:
    """What a list tells of an interface.

    :param number: of the shared memory on its blackboard.
    """

    type: str
    id: str
    hash: bytes
    number: int
    has_writer: bool
    num_readers: int
    timestamp_us: int

    def pack(self) -> bytes:
        """Return the element of the list: 152 bytes."""
        head = _INFO_HEAD.pack(
            pack_text(self.type, TYPE_SIZE),
            pack_text(self.id, ID_SIZE),
            self.hash,
            self.number,
            pack_presence(self.has_writer, self.num_readers),
        )
        return head + _INFO_STAMP.pack(*split_us(self.timestamp_us))

    @classmethod
    def unpack(cls, element: bytes) -> Self:
        """Read an element of the list."""
        expect_size(element, _INFO_HEAD.size + _INFO_STAMP.size, "an element of INTERFACE_LIST")
        type_, id_, hash_, number, word = _INFO_HEAD.unpack_from(element)
        has_writer, num_readers = unpack_presence(word)
        seconds, microseconds = _INFO_STAMP.unpack_from(element, _INFO_HEAD.size)
        return cls(
            type=unpack_text(type_),
            id=unpack_text(id_),
            hash=hash_,
            number=number,
            has_writer=has_writer,
            num_readers=num_readers,
            timestamp_us=join_us(seconds, microseconds),
        )


@dataclass(frozen=True, slots=True)
class InterfaceList(BlackBoardValue):
    """Answers LIST_ALL and LIST."""

    interfaces: tuple[Info, ...]
    kind: ClassVar[Kind] = Kind.INTERFACE_LIST

    def pack(self) -> bytes:
        """Return the payload."""
        return pack_list(info.pack() for info in self.interfaces)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        return cls(tuple(map(Info.unpack, unpack_list(payload, "INTERFACE_LIST"))))
