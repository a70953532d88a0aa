"""Messages of the blackboard component as typed values. Source: docs/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from struct import Struct
from typing import ClassVar, Final, Self
from uuid import UUID

from cxbridge.blackboard.fawkesnet.errors import MalformedMessageError
from cxbridge.blackboard.fawkesnet.messages.bb_base import (
    HASH_SIZE,
    ID_SIZE,
    MESSAGE_TYPE_SIZE,
    NAMES,
    TYPE_SIZE,
    BlackBoardValue,
    Kind,
    OpenError,
    pack_presence,
    unpack_presence,
)
from cxbridge.blackboard.fawkesnet.messages.bb_lists import Info, InterfaceList, ListAll, ListMatching
from cxbridge.blackboard.fawkesnet.messages.fields import (
    expect_at_least,
    expect_size,
    pack_text,
    unpack_text,
)
from cxbridge.blackboard.fawkesnet.messages.frames import HEADER, Component

__all__ = [
    "DATA_HEAD",
    "ID_SIZE",
    "MESSAGE_HEAD",
    "MESSAGE_TYPE_SIZE",
    "TYPE_SIZE",
    "BlackBoardMessage",
    "Close",
    "Data",
    "Info",
    "InstanceEvent",
    "InterfaceEvent",
    "InterfaceList",
    "InterfaceMessage",
    "Kind",
    "ListAll",
    "ListMatching",
    "Open",
    "OpenError",
    "OpenFailure",
    "OpenSuccess",
    "data_frame",
    "data_frame_size",
    "split_data",
    "unpack_blackboard",
]


_OPEN: Final = Struct(f"{TYPE_SIZE}s{ID_SIZE}s{HASH_SIZE}s")
_OPENED: Final = Struct(">16sII")
_FAILURE: Final = Struct(">I")
_SERIAL: Final = Struct("16s")
_SERIALS: Final = Struct("16s16s")
DATA_HEAD: Final = Struct(">16sI")
"""Serial of the instance, bytes of the block."""
MESSAGE_HEAD: Final = Struct(f">16s16s{MESSAGE_TYPE_SIZE}sIII")
"""Serial, source, message type, id, hops, bytes of the block."""

# numbers and functions that are looked up at each write
_pack_head: Final = Struct(">HHI16sI").pack
_BLACKBOARD: Final = int(Component.BLACKBOARD)
_REFRESHED: Final = int(Kind.DATA_REFRESHED)
_CHANGED: Final = int(Kind.DATA_CHANGED)
_HEAD_SIZE: Final = DATA_HEAD.size


@dataclass(frozen=True, slots=True)
class Open(BlackBoardValue):
    """Opens an interface.

    :param hash: of the definition, 16 bytes.
    :param writing: for writing, else for reading.
    """

    type: str
    id: str
    hash: bytes
    writing: bool

    @property
    def kind(self) -> Kind:
        """The kind of message."""
        return Kind.OPEN_FOR_WRITING if self.writing else Kind.OPEN_FOR_READING

    def pack(self) -> bytes:
        """Return the payload."""
        type_ = pack_text(self.type, TYPE_SIZE, terminated=False)
        return _OPEN.pack(type_, pack_text(self.id, ID_SIZE, terminated=False), self.hash)

    @classmethod
    def unpack(cls, payload: bytes, *, writing: bool) -> Self:
        """Read the payload."""
        expect_size(payload, _OPEN.size, "OPEN")
        type_, id_, hash_ = _OPEN.unpack(payload)
        return cls(unpack_text(type_), unpack_text(id_), hash_, writing)


@dataclass(frozen=True, slots=True)
class OpenSuccess(BlackBoardValue):
    """An interface is open.

    :param serial: of the new instance.
    :param num_readers: with the new one.
    :param block: the data now.
    """

    serial: UUID
    has_writer: bool
    num_readers: int
    block: bytes
    kind: ClassVar[Kind] = Kind.OPEN_SUCCESS

    def pack(self) -> bytes:
        """Return the payload."""
        word = pack_presence(self.has_writer, self.num_readers)
        return _OPENED.pack(self.serial.bytes, word, len(self.block)) + self.block

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        expect_at_least(payload, _OPENED.size, "OPEN_SUCCESS")
        serial, word, size = _OPENED.unpack_from(payload)
        expect_size(payload, _OPENED.size + size, "OPEN_SUCCESS")
        return cls(UUID(bytes=serial), *unpack_presence(word), payload[_OPENED.size :])


@dataclass(frozen=True, slots=True)
class OpenFailure(BlackBoardValue):
    """An interface cannot be opened.

    :param error: an :class:`OpenError`, or a number that is none.
    """

    error: int
    kind: ClassVar[Kind] = Kind.OPEN_FAILURE

    def pack(self) -> bytes:
        """Return the payload."""
        return _FAILURE.pack(self.error)

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        expect_size(payload, _FAILURE.size, "OPEN_FAILURE")
        return cls(*_FAILURE.unpack(payload))


@dataclass(frozen=True, slots=True)
class Close(BlackBoardValue):
    """Closes an instance."""

    serial: UUID
    kind: ClassVar[Kind] = Kind.CLOSE

    def pack(self) -> bytes:
        """Return the payload."""
        return self.serial.bytes

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        expect_size(payload, _SERIAL.size, "CLOSE")
        return cls(UUID(bytes=payload))


@dataclass(frozen=True, slots=True)
class InterfaceMessage(BlackBoardValue):
    """A message from a reader to the writer of an interface.

    :param serial: of the instance it was sent with; to the writer, of the writer.
    :param source: of the instance that sent it first.
    :param type: e.g. ``ExecSkillMessage``.
    :param id: counted by the sending instance.
    :param hops: how many networks it crossed before.
    :param block: its data.
    """

    serial: UUID
    source: UUID
    type: str
    id: int
    hops: int
    block: bytes
    kind: ClassVar[Kind] = Kind.INTERFACE_MESSAGE

    def pack(self) -> bytes:
        """Return the payload."""
        type_ = pack_text(self.type, MESSAGE_TYPE_SIZE)
        head = (self.serial.bytes, self.source.bytes, type_, self.id, self.hops, len(self.block))
        return MESSAGE_HEAD.pack(*head) + self.block

    @classmethod
    def unpack(cls, payload: bytes) -> Self:
        """Read the payload."""
        expect_at_least(payload, MESSAGE_HEAD.size, "INTERFACE_MESSAGE")
        serial, source, type_, id_, hops, size = MESSAGE_HEAD.unpack_from(payload)
        expect_size(payload, MESSAGE_HEAD.size + size, "INTERFACE_MESSAGE")
        block = payload[MESSAGE_HEAD.size :]
        return cls(UUID(bytes=serial), UUID(bytes=source), unpack_text(type_), id_, hops, block)


@dataclass(frozen=True, slots=True)
class Data(BlackBoardValue):
    """An interface was written.

    :param serial: of the instance that wrote; to a client, of the one that is told.
    :param changed: some value is another one; else only the time stamp may be.
    """

    serial: UUID
    block: bytes
    changed: bool

    @property
    def kind(self) -> Kind:
        """The kind of message."""
        return Kind.DATA_CHANGED if self.changed else Kind.DATA_REFRESHED

    def pack(self) -> bytes:
        """Return the payload."""
        return DATA_HEAD.pack(self.serial.bytes, len(self.block)) + self.block

    @classmethod
    def unpack(cls, payload: bytes, *, changed: bool) -> Self:
        """Read the payload."""
        serial, block = split_data(payload)
        return cls(UUID(bytes=serial), block, changed)


@dataclass(frozen=True, slots=True)
class InstanceEvent(BlackBoardValue):
    """An instance of an interface came or went.

    :param kind: READER_ADDED to WRITER_REMOVED.
    :param serial: of the instance that is told.
    :param event_serial: of the one that came or went.
    """

    kind: Kind
    serial: UUID
    event_serial: UUID

    def pack(self) -> bytes:
        """Return the payload."""
        return self.serial.bytes + self.event_serial.bytes

    @classmethod
    def unpack(cls, payload: bytes, *, kind: Kind) -> Self:
        """Read the payload."""
        expect_size(payload, _SERIALS.size, kind.name)
        serial, other = _SERIALS.unpack(payload)
        return cls(kind, UUID(bytes=serial), UUID(bytes=other))


@dataclass(frozen=True, slots=True)
class InterfaceEvent(BlackBoardValue):
    """An interface came into being or vanished.

    :param kind: INTERFACE_CREATED or INTERFACE_DESTROYED.
    """

    kind: Kind
    type: str
    id: str

    def pack(self) -> bytes:
        """Return the payload."""
        return pack_text(self.type, TYPE_SIZE) + pack_text(self.id, ID_SIZE)

    @classmethod
    def unpack(cls, payload: bytes, *, kind: Kind) -> Self:
        """Read the payload."""
        expect_size(payload, NAMES.size, kind.name)
        return cls(kind, *map(unpack_text, NAMES.unpack(payload)))


BlackBoardMessage = (
    ListAll
    | ListMatching
    | InterfaceList
    | Open
    | OpenSuccess
    | OpenFailure
    | Close
    | InterfaceMessage
    | Data
    | InstanceEvent
    | InterfaceEvent
)


def unpack_blackboard(kind: int, payload: bytes) -> BlackBoardMessage:
    """Read a message of the blackboard component.

    :raises MalformedMessageError: when there is no such kind, or the bytes make no sense.
    """
    match kind:
        case Kind.DATA_REFRESHED | Kind.DATA_CHANGED:
            return Data.unpack(payload, changed=kind == Kind.DATA_CHANGED)
        case Kind.OPEN_FOR_READING | Kind.OPEN_FOR_WRITING:
            return Open.unpack(payload, writing=kind == Kind.OPEN_FOR_WRITING)
        case Kind.READER_ADDED | Kind.READER_REMOVED | Kind.WRITER_ADDED | Kind.WRITER_REMOVED:
            return InstanceEvent.unpack(payload, kind=Kind(kind))
        case Kind.INTERFACE_CREATED | Kind.INTERFACE_DESTROYED:
            return InterfaceEvent.unpack(payload, kind=Kind(kind))
    for message in (
        ListAll,
        ListMatching,
        InterfaceList,
        OpenSuccess,
        OpenFailure,
        Close,
        InterfaceMessage,
    ):
        if message.kind == kind:
            return message.unpack(payload)
    raise MalformedMessageError(f"the blackboard has no messages of kind {kind}")


def split_data(payload: bytes) -> tuple[bytes, bytes]:
    """Return the serial, as 16 bytes, and the block of a data message.

    :raises MalformedMessageError: when the sizes do not fit together.
    """
    if len(payload) < _HEAD_SIZE:
        expect_at_least(payload, _HEAD_SIZE, "DATA")
    serial, size = DATA_HEAD.unpack_from(payload)
    if len(payload) != _HEAD_SIZE + size:
        expect_size(payload, _HEAD_SIZE + size, "DATA")
    return serial, payload[_HEAD_SIZE:]


def data_frame(serial: bytes, block: bytes, *, changed: bool) -> bytes:
    """Return the whole frame of a data message; the same as through :class:`Data`, but quick.

    :param serial: 16 bytes.
    """
    size = len(block)
    head = _pack_head(_BLACKBOARD, _CHANGED if changed else _REFRESHED, _HEAD_SIZE + size, serial, size)
    return head + block


def data_frame_size(block_size: int) -> int:
    """Return the bytes of the frame of a data message."""
    return HEADER.size + DATA_HEAD.size + block_size
