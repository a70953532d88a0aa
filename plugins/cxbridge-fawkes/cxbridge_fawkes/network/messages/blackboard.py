"""Messages of the blackboard component. Source: docs/evidence/protocol-fawkes.md.

Each message is a class with a :class:`~.layout.Layout`, which packs and unpacks its attributes. Data messages
also have functions without objects, because each write of an interface sends one or two of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum
from struct import Struct
from typing import ClassVar, Final, Protocol, Self
from uuid import UUID

from cxbridge_fawkes.network.messages.fields import (
    WireValue,
    check_min_size,
    check_size,
    pack_list,
    unpack_list,
)
from cxbridge_fawkes.network.messages.frames import HEADER, ComponentId
from cxbridge_fawkes.network.messages.layout import (
    PRESENCE,
    SERIAL,
    STAMP,
    WORD,
    Layout,
    raw_type,
    text_type,
)

# The sizes of the texts and hashes in Fawkes' C structs, in bytes.
TYPE_SIZE: Final = 48
ID_SIZE: Final = 64
MESSAGE_TYPE_SIZE: Final = 64
HASH_SIZE: Final = 16

DATA_HEAD: Final = Struct(">16sI")
"""The serial of the instance, and the size of the block."""

# in requests, a name may fill its whole field; in events, Fawkes cuts names so that the last byte is NUL
_REQUEST_NAMES: Final = {
    "type": text_type(TYPE_SIZE, terminated=False),
    "id": text_type(ID_SIZE, terminated=False),
}
_EVENT_NAMES: Final = {"type": text_type(TYPE_SIZE), "id": text_type(ID_SIZE)}


class BoardKind(IntEnum):
    """Kinds of messages, without WRITE (7): a write sends DATA_REFRESHED, DATA_CHANGED or both."""

    LIST_ALL = 0
    INTERFACE_LIST = 1
    OPEN_FOR_READING = 2
    OPEN_FOR_WRITING = 3
    OPEN_SUCCESS = 4
    OPEN_FAILURE = 5
    CLOSE = 6
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
    """A message whose class or instance has the attribute ``kind``."""

    @property
    def kind(self) -> BoardKind:
        """The kind of message: a constant of the class, or derived from the attributes."""


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
    def unpack(cls, payload: bytes, **attributes: object) -> Self:
        """Parse a payload.

        :param attributes: the attributes that the kind of message determines.
        :raises MalformedMessageError: if the bytes are invalid.
        """
        return cls(**cls.LAYOUT.unpack(payload), **attributes)


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
    LAYOUT: ClassVar = Layout(
        "LIST", {"type_pattern": _REQUEST_NAMES["type"], "id_pattern": _REQUEST_NAMES["id"]}
    )


@dataclass(frozen=True, slots=True)
class ListedInterface:
    """An interface in a list.

    :param number: the number of the interface's shared memory on its blackboard.
    """

    type: str
    id: str
    hash: bytes
    number: int
    has_writer: bool
    num_readers: int
    timestamp_us: int

    LAYOUT: ClassVar = Layout(
        "an element of INTERFACE_LIST",
        {
            **_EVENT_NAMES,
            "hash": raw_type(HASH_SIZE),
            "number": WORD,
            "has_writer num_readers": PRESENCE,
            "timestamp_us": STAMP,
        },
    )


@dataclass(frozen=True, slots=True)
class InterfaceList(BlackBoardMessage):
    """The reply to LIST_ALL and LIST."""

    interfaces: tuple[ListedInterface, ...]
    kind: ClassVar[BoardKind] = BoardKind.INTERFACE_LIST

    def pack(self) -> bytes:
        return pack_list(map(ListedInterface.LAYOUT.pack, self.interfaces))

    @classmethod
    def unpack(cls, payload: bytes, **_: object) -> Self:
        elements = unpack_list(payload, "INTERFACE_LIST")
        return cls(tuple(ListedInterface(**ListedInterface.LAYOUT.unpack(element)) for element in elements))


@dataclass(frozen=True, slots=True)
class Open(BlackBoardMessage):
    """A request to open an interface.

    :param hash: the hash of the definition, 16 bytes.
    :param writing: whether to open the interface for writing, instead of reading.
    """

    type: str
    id: str
    hash: bytes
    writing: bool
    LAYOUT: ClassVar = Layout("OPEN", _REQUEST_NAMES | {"hash": raw_type(HASH_SIZE)})

    @property
    def kind(self) -> BoardKind:
        return BoardKind.OPEN_FOR_WRITING if self.writing else BoardKind.OPEN_FOR_READING


@dataclass(frozen=True, slots=True)
class OpenSuccess(BlackBoardMessage):
    """The reply about an opened interface.

    :param serial: the opened instance.
    :param num_readers: the number of readers, including the opened instance if it reads.
    :param block: the present data.
    """

    serial: UUID
    has_writer: bool
    num_readers: int
    block: bytes
    kind: ClassVar[BoardKind] = BoardKind.OPEN_SUCCESS
    LAYOUT: ClassVar = Layout(
        "OPEN_SUCCESS", {"serial": SERIAL, "has_writer num_readers": PRESENCE}, has_block=True
    )


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
    :param type: the type of the message, e.g. ``ExecSkillMessage``.
    :param id: the number of the message, counted by the sending instance.
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
            "type": text_type(MESSAGE_TYPE_SIZE),
            "id": WORD,
            "hops": WORD,
        },
        has_block=True,
    )


@dataclass(frozen=True, slots=True)
class DataMessage(BlackBoardMessage):
    """A write of an interface.

    :param serial: the writing instance; towards a client, its receiving instance.
    :param changed: whether any value has changed, rather than only the time stamp.
    """

    serial: UUID
    block: bytes
    changed: bool
    LAYOUT: ClassVar = Layout("DATA", {"serial": SERIAL}, has_block=True)

    @property
    def kind(self) -> BoardKind:
        return BoardKind.DATA_CHANGED if self.changed else BoardKind.DATA_REFRESHED


@dataclass(frozen=True, slots=True)
class InstanceEvent(BlackBoardMessage):
    """An added or removed instance of an interface.

    :param kind: READER_ADDED to WRITER_REMOVED.
    :param serial: the notified instance.
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
    LAYOUT: ClassVar = Layout("an event of an interface", _EVENT_NAMES)


MESSAGE_HEAD_SIZE: Final = WireMessage.LAYOUT.size
"""The size of a message before its block."""

_INSTANCE_EVENTS: Final = (
    BoardKind.READER_ADDED,
    BoardKind.READER_REMOVED,
    BoardKind.WRITER_ADDED,
    BoardKind.WRITER_REMOVED,
)
MESSAGES: Final[dict[int, tuple[type[BlackBoardMessage], dict[str, object]]]] = {
    BoardKind.LIST_ALL: (ListAll, {}),
    BoardKind.LIST: (ListMatching, {}),
    BoardKind.INTERFACE_LIST: (InterfaceList, {}),
    BoardKind.OPEN_FOR_READING: (Open, {"writing": False}),
    BoardKind.OPEN_FOR_WRITING: (Open, {"writing": True}),
    BoardKind.OPEN_SUCCESS: (OpenSuccess, {}),
    BoardKind.OPEN_FAILURE: (OpenFailure, {}),
    BoardKind.CLOSE: (Close, {}),
    BoardKind.INTERFACE_MESSAGE: (WireMessage, {}),
    BoardKind.DATA_REFRESHED: (DataMessage, {"changed": False}),
    BoardKind.DATA_CHANGED: (DataMessage, {"changed": True}),
    **{kind: (InstanceEvent, {"kind": kind}) for kind in _INSTANCE_EVENTS},
    BoardKind.INTERFACE_CREATED: (InterfaceEvent, {"kind": BoardKind.INTERFACE_CREATED}),
    BoardKind.INTERFACE_DESTROYED: (InterfaceEvent, {"kind": BoardKind.INTERFACE_DESTROYED}),
}
"""The class of each kind of message, and the attributes that the kind determines."""

_FRAME_HEAD: Final = Struct(HEADER.format + DATA_HEAD.format[1:])  # [1:]: without the byte order


def unpack_data(payload: bytes) -> tuple[bytes, bytes]:
    """Return the serial as 16 bytes, and the block of a data message.

    :raises MalformedMessageError: if the sizes are inconsistent.
    """
    check_min_size(payload, DATA_HEAD.size, "DATA")
    serial, size = DATA_HEAD.unpack_from(payload)
    check_size(payload, DATA_HEAD.size + size, "DATA")
    return serial, payload[DATA_HEAD.size :]


def pack_data_frame(serial: bytes, block: bytes, *, changed: bool) -> bytes:
    """Return the frame of a data message, faster than :class:`DataMessage`.

    :param serial: 16 bytes.
    """
    kind, size = BoardKind.DATA_CHANGED if changed else BoardKind.DATA_REFRESHED, len(block)
    return _FRAME_HEAD.pack(ComponentId.BLACKBOARD, kind, DATA_HEAD.size + size, serial, size) + block


def data_frame_size(block_size: int) -> int:
    return HEADER.size + DATA_HEAD.size + block_size
