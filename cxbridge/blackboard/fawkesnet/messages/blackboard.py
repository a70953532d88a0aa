"""Messages of the blackboard component. Source: docs/evidence/protocol-fawkes.md."""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import ClassVar, Final, Protocol, Self
from uuid import UUID

from cxbridge.blackboard.fawkesnet.errors import MalformedMessageError
from cxbridge.blackboard.fawkesnet.messages.fields import (
    WireValue,
    expect_at_least,
    expect_size,
    pack_list,
    pack_text,
    unpack_list,
    unpack_text,
)
from cxbridge.blackboard.fawkesnet.messages.frames import HEADER, ComponentId
from cxbridge.blackboard.fawkesnet.messages.layout import SERIAL, WORD, Layout, raw, text
from cxbridge.clock import join_us, split_us

TYPE_SIZE: Final = 48  # fixed sizes of Fawkes' C structs, in bytes
ID_SIZE: Final = 64
MESSAGE_TYPE_SIZE: Final = 64
HASH_SIZE: Final = 16

_INFO_HEAD: Final = Struct(f">{TYPE_SIZE}s{ID_SIZE}s{HASH_SIZE}sII")
_INFO_STAMP: Final = Struct("=qq")
_OPENED: Final = Struct(">16sII")
DATA_HEAD: Final = Struct(">16sI")
"""The serial of the instance, and the size of the block."""
_HAS_WRITER: Final = 1 << 31  # the highest bit of the number of readers

_PATTERN: Final = {
    "type": text(TYPE_SIZE, terminated=False),
    "id": text(ID_SIZE, terminated=False),
}
_NAMES: Final = {"type": text(TYPE_SIZE), "id": text(ID_SIZE)}


class BoardKind(IntEnum):
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
    """Reasons of a failed opening."""

    UNKNOWN = 0
    UNKNOWN_TYPE = 1
    HASH_MISMATCH = 2
    WRITER_EXISTS = 3


class _HasKind(Protocol):
    @property
    def kind(self) -> BoardKind:
        """The kind of message, fixed by the class or computed from the value."""


class BlackBoardMessage(WireValue):
    """A message of the blackboard component.

    :cvar LAYOUT: the fields on the wire; empty for messages that pack themselves.
    """

    __slots__ = ()
    COMPONENT: ClassVar[ComponentId] = ComponentId.BLACKBOARD
    LAYOUT: ClassVar[Layout] = Layout("nothing")

    @property
    def message_kind(self: _HasKind) -> int:
        """The number of the message within its component."""
        return self.kind

    def pack(self) -> bytes:
        return self.LAYOUT.pack(self)

    @classmethod
    def unpack(cls, payload: bytes, **known: object) -> Self:
        """Parse a payload.

        :param known: values given by the kind of message.
        :raises MalformedMessageError: if the bytes are invalid.
        """
        return cls(**cls.LAYOUT.unpack(payload), **known)


def pack_presence(has_writer: bool, num_readers: int) -> int:
    """Return the word with the writer flag and the number of readers."""
    return (_HAS_WRITER if has_writer else 0) | min(num_readers, _HAS_WRITER - 1)


def unpack_presence(word: int) -> tuple[bool, int]:
    """Return the writer flag and the number of readers."""
    return bool(word & _HAS_WRITER), word & ~_HAS_WRITER


@dataclass(frozen=True, slots=True)
class ListAll(BlackBoardMessage):
    """A request for all interfaces."""

    kind: ClassVar[BoardKind] = BoardKind.LIST_ALL
    LAYOUT: ClassVar = Layout("LIST_ALL")


@dataclass(frozen=True, slots=True)
class ListMatching(BlackBoardMessage):
    """A request for the interfaces that match two shell patterns."""

    type_pattern: str
    id_pattern: str
    kind: ClassVar[BoardKind] = BoardKind.LIST
    LAYOUT: ClassVar = Layout("LIST", {"type_pattern": _PATTERN["type"], "id_pattern": _PATTERN["id"]})


@dataclass(frozen=True, slots=True)
class ListedInterface:
    """An interface in a list.

    :param number: the number of the shared memory on its blackboard.
    """

    type: str
    id: str
    hash: bytes
    number: int
    has_writer: bool
    num_readers: int
    timestamp_us: int

    def pack(self) -> bytes:
        """Return the list element: 152 bytes."""
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
class InterfaceList(BlackBoardMessage):
    """The reply to LIST_ALL and LIST."""

    interfaces: tuple[ListedInterface, ...]
    kind: ClassVar[BoardKind] = BoardKind.INTERFACE_LIST

    def pack(self) -> bytes:
        return pack_list(info.pack() for info in self.interfaces)

    @classmethod
    def unpack(cls, payload: bytes, **_: object) -> Self:
        return cls(tuple(map(ListedInterface.unpack, unpack_list(payload, "INTERFACE_LIST"))))


@dataclass(frozen=True, slots=True)
class Open(BlackBoardMessage):
    """A request to open an interface.

    :param hash: the hash of the definition, 16 bytes.
    :param writing: for writing rather than reading.
    """

    type: str
    id: str
    hash: bytes
    writing: bool
    LAYOUT: ClassVar = Layout("OPEN", _PATTERN | {"hash": raw(HASH_SIZE)})

    @property
    def kind(self) -> BoardKind:
        return BoardKind.OPEN_FOR_WRITING if self.writing else BoardKind.OPEN_FOR_READING


@dataclass(frozen=True, slots=True)
class OpenSuccess(BlackBoardMessage):
    """The reply about an opened interface.

    :param num_readers: including the new one.
    :param block: the present data.
    """

    serial: UUID
    has_writer: bool
    num_readers: int
    block: bytes
    kind: ClassVar[BoardKind] = BoardKind.OPEN_SUCCESS

    def pack(self) -> bytes:
        word = pack_presence(self.has_writer, self.num_readers)
        return _OPENED.pack(self.serial.bytes, word, len(self.block)) + self.block

    @classmethod
    def unpack(cls, payload: bytes, **_: object) -> Self:
        expect_at_least(payload, _OPENED.size, "OPEN_SUCCESS")
        serial, word, size = _OPENED.unpack_from(payload)
        expect_size(payload, _OPENED.size + size, "OPEN_SUCCESS")
        return cls(UUID(bytes=serial), *unpack_presence(word), payload[_OPENED.size :])


@dataclass(frozen=True, slots=True)
class OpenFailure(BlackBoardMessage):
    """The reply about a failed opening.

    :param error: an :class:`OpenError`, or an unknown number.
    """

    error: int
    kind: ClassVar[BoardKind] = BoardKind.OPEN_FAILURE
    LAYOUT: ClassVar = Layout("OPEN_FAILURE", {"error": WORD})


@dataclass(frozen=True, slots=True)
class Close(BlackBoardMessage):
    """A request to close an instance."""

    serial: UUID
    kind: ClassVar[BoardKind] = BoardKind.CLOSE
    LAYOUT: ClassVar = Layout("CLOSE", {"serial": SERIAL})


@dataclass(frozen=True, slots=True)
class WireMessage(BlackBoardMessage):
    """A message from a reader to the writer of an interface.

    :param serial: the sending instance; towards the writer, the writing instance.
    :param source: the original sender.
    :param type: e.g. ``ExecSkillMessage``.
    :param id: counted by the sending instance.
    :param hops: the number of crossed networks.
    :param block: the data.
    """

    serial: UUID
    source: UUID
    type: str
    id: int
    hops: int
    block: bytes
    kind: ClassVar[BoardKind] = BoardKind.INTERFACE_MESSAGE
    LAYOUT: ClassVar = Layout(
        "INTERFACE_MESSAGE",
        {
            "serial": SERIAL,
            "source": SERIAL,
            "type": text(MESSAGE_TYPE_SIZE),
            "id": WORD,
            "hops": WORD,
        },
        block=True,
    )


@dataclass(frozen=True, slots=True)
class Data(BlackBoardMessage):
    """A write of an interface.

    :param serial: the writing instance; towards a client, its receiving instance.
    :param changed: whether any value has changed, rather than only the time stamp.
    """

    serial: UUID
    block: bytes
    changed: bool
    LAYOUT: ClassVar = Layout("DATA", {"serial": SERIAL}, block=True)

    @property
    def kind(self) -> BoardKind:
        return BoardKind.DATA_CHANGED if self.changed else BoardKind.DATA_REFRESHED


@dataclass(frozen=True, slots=True)
class InstanceEvent(BlackBoardMessage):
    """An added or removed instance of an interface.

    :param kind: READER_ADDED to WRITER_REMOVED.
    :param event_serial: the added or removed instance.
    """

    kind: BoardKind
    serial: UUID
    event_serial: UUID
    LAYOUT: ClassVar = Layout("an event of an instance", {"serial": SERIAL, "event_serial": SERIAL})


@dataclass(frozen=True, slots=True)
class InterfaceEvent(BlackBoardMessage):
    """A created or destroyed interface."""

    kind: BoardKind
    type: str
    id: str
    LAYOUT: ClassVar = Layout("an event of an interface", _NAMES)


MESSAGE_HEAD_SIZE: Final = WireMessage.LAYOUT.size
"""The size of a message before its block."""

# looked up once: they are used for each write
_pack_head: Final = Struct(">HHI16sI").pack
_BLACKBOARD: Final = int(ComponentId.BLACKBOARD)
_REFRESHED: Final = int(BoardKind.DATA_REFRESHED)
_CHANGED: Final = int(BoardKind.DATA_CHANGED)
_HEAD_SIZE: Final = DATA_HEAD.size


def unpack_blackboard(kind: int, payload: bytes) -> BlackBoardMessage:
    """Parse a message of the blackboard component.

    :raises MalformedMessageError: if the kind is unknown or the bytes are invalid.
    """
    match kind:
        case BoardKind.DATA_REFRESHED | BoardKind.DATA_CHANGED:
            return Data.unpack(payload, changed=kind == BoardKind.DATA_CHANGED)
        case BoardKind.OPEN_FOR_READING | BoardKind.OPEN_FOR_WRITING:
            return Open.unpack(payload, writing=kind == BoardKind.OPEN_FOR_WRITING)
        case (
            BoardKind.READER_ADDED
            | BoardKind.READER_REMOVED
            | BoardKind.WRITER_ADDED
            | BoardKind.WRITER_REMOVED
        ):
            return InstanceEvent.unpack(payload, kind=BoardKind(kind))
        case BoardKind.INTERFACE_CREATED | BoardKind.INTERFACE_DESTROYED:
            return InterfaceEvent.unpack(payload, kind=BoardKind(kind))
    for message in (
        ListAll,
        ListMatching,
        InterfaceList,
        OpenSuccess,
        OpenFailure,
        Close,
        WireMessage,
    ):
        if message.kind == kind:
            return message.unpack(payload)
    raise MalformedMessageError(f"the blackboard has no messages of kind {kind}")


def split_data(payload: bytes) -> tuple[bytes, bytes]:
    """Return the serial as 16 bytes, and the block of a data message.

    :raises MalformedMessageError: if the sizes are inconsistent.
    """
    if len(payload) < _HEAD_SIZE:
        expect_at_least(payload, _HEAD_SIZE, "DATA")
    serial, size = DATA_HEAD.unpack_from(payload)
    if len(payload) != _HEAD_SIZE + size:
        expect_size(payload, _HEAD_SIZE + size, "DATA")
    return serial, payload[_HEAD_SIZE:]


def data_frame(serial: bytes, block: bytes, *, changed: bool) -> bytes:
    """Return the frame of a data message, faster than :class:`Data`.

    :param serial: 16 bytes.
    """
    size = len(block)
    head = _pack_head(_BLACKBOARD, _CHANGED if changed else _REFRESHED, _HEAD_SIZE + size, serial, size)
    return head + block


def data_frame_size(block_size: int) -> int:
    return HEADER.size + DATA_HEAD.size + block_size
