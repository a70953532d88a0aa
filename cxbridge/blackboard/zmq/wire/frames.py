"""The frames of the protocol, and their bytes.

A frame is one MessagePack array: the number of its kind, the values of its fields, and its number in the
session. The decoders check types, sizes and limits. docs/evidence/protocol-zmq.md describes the meaning.
"""

from __future__ import annotations

from collections.abc import Callable
from enum import IntEnum
from typing import Annotated, Final

from msgspec import DecodeError, Meta, Struct
from msgspec.msgpack import Decoder, Encoder

from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.listeners import EventKind

VERSION: Final = 3
"""The version of the protocol. Both peers must have the same one."""

EVENTS: Final = b"e"
"""The first byte of the routing id of a client's events socket; the session's id follows."""

COMMANDS: Final = b"c"
"""The first byte of the routing id of a client's commands socket; the session's id follows."""

# below three, so that the check, four times a heartbeat, notices a dead peer within three heartbeats
DEATH: Final = 2.5
"""The number of heartbeats without a frame after which a peer is dead."""

# below one, so that each interval has a frame
BEAT: Final = 0.75
"""The number of heartbeats without sending after which a Beat is sent."""

MAX_FRAME: Final = 1 << 20
"""The maximal bytes of a frame to the server."""

# lists of interfaces can be long
MAX_REPLY: Final = 64 << 20
"""The maximal bytes of a frame to a client."""

MAX_TEXT: Final = 256
"""The maximal characters of names of owners, threads and clients, and of patterns."""

# those of a UUID, and of an MD5 for types
SERIAL_SIZE: Final = 16
"""The bytes of the ids of sessions, epochs, instances and types."""

Serial = Annotated[bytes, Meta(min_length=SERIAL_SIZE, max_length=SERIAL_SIZE)]
Text = Annotated[str, Meta(max_length=MAX_TEXT)]
Uint32 = Annotated[int, Meta(ge=0, lt=1 << 32)]


class ResultCode(IntEnum):
    """The outcome of a request, or the reason for the end of a session."""

    OK = 0
    DECLINED = 1
    NO_WRITER = 2
    WRITER_ACTIVE = 3
    UNKNOWN_TYPE = 4
    VERSION_MISMATCH = 5
    INVALID_NAME = 6
    QUEUE_FULL = 7
    INVALID_INSTANCE = 8
    UNKNOWN_MESSAGE = 9
    TIMEOUT = 10
    TOO_MANY = 11
    PROTOCOL = 12
    UNKNOWN_SESSION = 13
    FRAME_LOST = 14
    SILENT = 15
    TOO_SLOW = 16
    SHUTDOWN = 17
    REFUSED = 18


# arrays: names of fields would cost time and bytes in each frame
class Frame(Struct, array_like=True, tag_field="frame", kw_only=True):
    """A frame.

    :param number: counts the frames of one direction in a session, from 1; 0 for Hello, Update and a Gone
        without session.
    """

    number: int = 0


class Request(Frame, kw_only=True):
    """A frame of a client that gets a reply.

    :param request: the client's number of the request.
    """

    request: int = 0


class Response(Frame, kw_only=True):
    """A reply of the server to the request with the same number."""

    request: int


class Hello(Frame, tag=1):
    """The first frame of a client.

    :param replaces: the client's previous session, which the server ends; else empty.
    :param name: identifies the client in the server's log.
    """

    session: Serial
    version: int = VERSION
    replaces: bytes = b""
    heartbeat_ms: Uint32 = 0
    name: Text = ""


class Open(Request, tag=2):
    """A request to open an interface; the reply is Opened, or Reply with a refusal."""

    type: Text
    id: Text
    hash: Serial
    size: Uint32
    owner: Text = ""
    writer: bool = False


class Close(Request, tag=3):
    """A request to close an instance; the Reply's detail is the interface's sequence number."""

    instance: Serial


class List(Request, tag=4):
    """A request for the interfaces that match two shell patterns; the reply is Listed."""

    type_glob: Text
    id_glob: Text


class Watch(Request, tag=5):
    """A request for all interfaces (Listed), and for Existence frames from now on."""


class Sync(Request, tag=6):
    """A request for a Reply after all earlier frames are handled and all earlier writes are sent."""


class Send(Request, tag=7):
    """A message of a reader; the Reply says whether the message is in the writer's queue.

    :param instance: the serial of the sender.
    :param source: the serial of the first sender.
    """

    instance: Serial
    source: Serial
    type: Text
    id: Uint32
    thread: Text
    hops: Uint32
    block: bytes


class Write(Frame, tag=8):
    """The block of a writer.

    :param stamped: whether the time stamp is new; None: to be found by comparison.
    """

    instance: Serial
    stamped: bool | None
    changed: bool
    block: bytes


class Credit(Frame, tag=9):
    """The number of updates that the client has handled."""

    updates: Uint32


class Delivered(Frame, tag=10):
    """The outcome of a Deliver."""

    delivery: int
    code: ResultCode
    detail: int = 0


class Beat(Frame, tag=11):
    """A sign of life, of the client or of the server."""


class Bye(Frame, tag=12):
    """The end of a session by the client."""


# kinds from here on are sent by the server; only Beat goes both ways
class Welcome(Frame, tag=20):
    """The reply to Hello.

    :param epoch: the id of the running server.
    :param window: the number of updates that may be sent without Credit.
    """

    epoch: Serial
    heartbeat_ms: Uint32
    window: Uint32


class Reply(Response, tag=21):
    """The outcome of a request.

    :param text: for log lines; of WRITER_ACTIVE the owner of the writer.
    :param hash: of VERSION_MISMATCH, the type's version at the server.
    """

    code: ResultCode = ResultCode.OK
    detail: int = 0
    text: str = ""
    hash: bytes = b""


class Member(Struct, array_like=True):
    """An open instance of an interface, at any client or in the server's process."""

    serial: Serial
    owner: str
    writer: bool


class Opened(Response, tag=22):
    """An opened interface.

    :param channel: the number of the interface at the server.
    :param seq: the sequence number of the present data.
    :param block: the present data; None if the session has the interface open already.
    """

    instance: Serial
    channel: int
    seq: int
    stamped: bool
    changed: bool
    members: list[Member]
    block: bytes | None


class Listed(Response, tag=23):
    """The reply to List and Watch."""

    interfaces: list[InterfaceInfo]


class Update(Frame, tag=24):
    """The data after write ``seq``; ``skipped`` earlier writes were not sent."""

    channel: int
    seq: int
    stamped: bool
    changed: bool
    skipped: int
    block: bytes


class Change(Frame, tag=25):
    """An opened or closed instance of an interface."""

    channel: int
    kind: EventKind
    serial: Serial
    owner: str


class Deliver(Frame, tag=26):
    """A message to the writer ``instance``, which the client answers with Delivered."""

    instance: Serial
    source: Serial
    sender: Serial
    type: Text
    id: Uint32
    thread: Text
    hops: Uint32
    block: bytes
    delivery: int = 0


class Existence(Frame, tag=27):
    """A created or destroyed interface."""

    created: bool
    type: str
    id: str


class Gone(Frame, tag=28):
    """The end of a session by the server."""

    code: ResultCode
    text: str


ClientFrame = Hello | Open | Close | List | Watch | Sync | Send | Write | Credit | Delivered | Beat | Bye
ServerFrame = Welcome | Reply | Opened | Listed | Update | Change | Deliver | Existence | Gone | Beat

# made once: a decoder's construction takes longer than the decoding of a frame
_encode: Final = Encoder().encode
_decode_client_frame: Final[Callable[[bytes], ClientFrame]] = Decoder(ClientFrame).decode
_decode_server_frame: Final[Callable[[bytes], ServerFrame]] = Decoder(ServerFrame).decode


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame.

    :raises ProtocolError: if a text has no UTF-8 form, or a number has more than 64 bits.
    """
    try:
        return _encode(frame)
    except (UnicodeError, OverflowError) as error:
        raise ProtocolError(f"{type(frame).__name__} cannot be sent: {error}") from error


def decode_client_frame(data: bytes) -> ClientFrame:
    """Return the frame that a client has sent.

    :raises ProtocolError: if the bytes are invalid, or exceed a limit.
    """
    try:
        return _decode_client_frame(data)
    except (DecodeError, UnicodeError) as error:
        raise _invalid(error) from error


def decode_server_frame(data: bytes) -> ServerFrame:
    """Return the frame that a server has sent.

    :raises ProtocolError: if the bytes are invalid.
    """
    try:
        return _decode_server_frame(data)
    except (DecodeError, UnicodeError) as error:
        raise _invalid(error) from error


def _invalid(error: Exception) -> ProtocolError:
    return ProtocolError(
        f"not a frame of version {VERSION} of the blackboard's protocol: {error}",
        hint="let both sides run the same version of cxbridge",
    )
