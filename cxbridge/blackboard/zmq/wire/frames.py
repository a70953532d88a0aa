"""The frames of the protocol, and their bytes.

The frames of a session (Hello, Open, Change, ...) are protobuf envelopes (envelope.proto). The data frames,
which each write and message needs, are MessagePack arrays, which take msgspec a sixth of the time. The array
has the number of the kind (``tag``), the values of the fields, the number in the session, and, for Send and
Reply, the number of the request. The decoders check types, sizes and limits.
docs/evidence/protocol-zmq.md describes the meaning.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from enum import IntEnum
from pathlib import Path
from typing import Annotated, Any, Final, TypeVar, get_args

from google.protobuf import message
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message_factory import GetMessageClass
from msgspec import DecodeError, Meta, Struct, ValidationError, convert, to_builtins
from msgspec.msgpack import Decoder, Encoder

from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.listeners import EventKind

VERSION: Final = 3
"""The version of the protocol, which both peers must have."""

EVENTS_PREFIX: Final = b"e"
"""The first byte of the routing id of a client's events socket; the session's id follows."""

COMMANDS_PREFIX: Final = b"c"
"""The first byte of the routing id of a client's commands socket; the session's id follows."""

# below three, so that a check four times a heartbeat notices a dead peer within three heartbeats
DEATH_HEARTBEATS: Final = 2.5
"""The number of heartbeats without a received frame after which a peer counts as dead."""

# below one, so that each heartbeat has a frame
BEAT_HEARTBEATS: Final = 0.75
"""The number of heartbeats without a sent frame after which a peer sends a Beat."""

MAX_FRAME_BYTES: Final = 1 << 20
"""The maximum size of a frame to the server, in bytes."""

# lists of interfaces can be long
MAX_REPLY_BYTES: Final = 64 << 20
"""The maximum size of a frame to a client, in bytes."""

MAX_TEXT_LENGTH: Final = 256
"""The maximum length of a pattern, or of the name of an owner, a thread or a client, in characters."""

# a UUID has 16 bytes, and so has the MD5 of a type
SERIAL_SIZE: Final = 16
"""The size of the ids of sessions, epochs, instances and types, in bytes."""

Serial = Annotated[bytes, Meta(min_length=SERIAL_SIZE, max_length=SERIAL_SIZE)]
Text = Annotated[str, Meta(max_length=MAX_TEXT_LENGTH)]
Uint32 = Annotated[int, Meta(ge=0, lt=1 << 32)]


class ResultCode(IntEnum):
    """The outcome of a request, or the reason for the end of a session."""

    OK = 0
    DECLINED = 1  # a listener of the writer has handled the message
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
    SILENT = 15  # no frame within DEATH_HEARTBEATS, or a lost connection
    TOO_SLOW = 16  # the queue of frames to the client is full
    SHUTDOWN = 17
    REFUSED = 18  # for a reason in the text


class Frame(Struct, kw_only=True):
    """A frame.

    :param number: the number of the frame among the frames of its direction in a session, from 1; 0 for
        Hello, Update, and each Gone except at the shutdown of the server.
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


class Hello(Frame):
    """The first frame of a client.

    :param replaces: the client's previous session, which the server ends; else empty.
    :param name: identifies the client in the server's log.
    """

    session: Serial
    replaces: bytes = b""
    name: Text = ""


class Open(Request):
    """A request to open an interface; the reply is Opened, or Reply with a refusal."""

    type: Text
    id: Text
    hash: Serial
    size: Uint32
    owner: Text = ""
    writer: bool = False


class Close(Request):
    """A request to close an instance; the Reply's detail is the interface's sequence number."""

    instance: Serial


class List(Request):
    """A request for the interfaces that match two shell patterns; the reply is Listed."""

    type_glob: Text
    id_glob: Text


class Watch(Request):
    """A request for all interfaces (Listed), and for Existence frames from now on."""


class Sync(Request):
    """A request for a Reply after the server has handled all earlier frames and sent all earlier writes."""


class Send(Request, array_like=True, tag_field="frame", tag=7):
    """A message of a reader; the Reply says whether the message is in the writer's queue.

    :param instance: the serial of the sender.
    :param source: the serial of the first sender.
    :param thread: the name of the sending thread.
    :param hops: the number of networks that the message has crossed.
    """

    instance: Serial
    source: Serial
    type: Text
    id: Uint32
    thread: Text
    hops: Uint32
    block: bytes


class Write(Frame, array_like=True, tag_field="frame", tag=8):
    """The block of a writer.

    :param stamped: whether the time stamp is new; None to compare the time stamps of the blocks.
    """

    instance: Serial
    stamped: bool | None
    changed: bool
    block: bytes


class Credit(Frame, array_like=True, tag_field="frame", tag=9):
    """The number of updates that the client has handled."""

    updates: Uint32


class Delivered(Frame, array_like=True, tag_field="frame", tag=10):
    """The outcome of a Deliver.

    :param detail: for QUEUE_FULL, the limit of the queue.
    """

    delivery: int
    code: ResultCode
    detail: int = 0


class Beat(Frame):
    """A sign of life, of the client or of the server."""


class Bye(Frame):
    """The end of a session by the client."""


# the server sends the following frames, and Beat
class Welcome(Frame):
    """The reply to Hello.

    :param epoch: the id of the running server.
    :param window: the maximum number of updates that the server sends without Credit.
    """

    epoch: Serial
    heartbeat_ms: Uint32
    window: Uint32


class Reply(Response, array_like=True, tag_field="frame", tag=21):
    """The outcome of a request.

    :param detail: the sequence number for Close; for QUEUE_FULL, the limit of the queue.
    :param text: the text for log lines; for WRITER_ACTIVE, the owner of the writer.
    :param hash: for VERSION_MISMATCH, the hash of the type at the server.
    """

    code: ResultCode = ResultCode.OK
    detail: int = 0
    text: str = ""
    hash: bytes = b""


class Member(Struct):
    """An open instance of an interface, at any client or in the server's process."""

    serial: Serial
    owner: str
    writer: bool


class Opened(Response):
    """An opened interface.

    :param channel: the number of the interface at the server.
    :param seq: the sequence number of the present data.
    :param stamped: whether any write had a new time stamp; False without block.
    :param changed: whether any write has changed the data; False without block.
    :param block: the present data; None if the session has the present data already.
    """

    instance: Serial
    channel: int
    seq: int
    stamped: bool
    changed: bool
    members: list[Member]
    block: bytes | None


class Listed(Response):
    """The reply to List and Watch."""

    interfaces: list[InterfaceInfo]


class Update(Frame, array_like=True, tag_field="frame", tag=24):
    """The data after write ``seq``; ``skipped`` earlier writes were not sent."""

    channel: int
    seq: int
    stamped: bool
    changed: bool
    skipped: int
    block: bytes


class Change(Frame):
    """An opened or closed instance of an interface."""

    channel: int
    kind: EventKind
    serial: Serial
    owner: str


class Deliver(Frame, array_like=True, tag_field="frame", tag=26):
    """A message to the writer ``instance``, which the client answers with Delivered.

    :param source: the serial of the first sender.
    :param sender: the serial of the last sender.
    :param thread: the name of the sending thread.
    :param hops: the number of networks that the message has crossed.
    :param delivery: the server's number of the delivery.
    """

    instance: Serial
    source: Serial
    sender: Serial
    type: Text
    id: Uint32
    thread: Text
    hops: Uint32
    block: bytes
    delivery: int = 0


class Existence(Frame):
    """A created or destroyed interface."""

    created: bool
    type: str
    id: str


class Gone(Frame):
    """The end of a session by the server."""

    code: ResultCode
    text: str


ClientFrame = Hello | Open | Close | List | Watch | Sync | Send | Write | Credit | Delivered | Beat | Bye
ServerFrame = Welcome | Reply | Opened | Listed | Update | Change | Deliver | Existence | Gone | Beat

ClientData = Send | Write | Credit | Delivered
ServerData = Reply | Update | Deliver

# constructed once, because the construction of a decoder takes longer than the decoding of a frame
_encode: Final = Encoder().encode
_decode_client_data: Final[Callable[[bytes], ClientData]] = Decoder(ClientData).decode
_decode_server_data: Final[Callable[[bytes], ServerData]] = Decoder(ServerData).decode

_DATA_FRAMES: Final = frozenset(get_args(ClientData | ServerData))
_DATA_FIRST_BYTES: Final = range(0x90, 0xA0)
"""The first bytes of MessagePack's arrays of up to 15 values; an envelope begins with 08, a protobuf tag."""

_FrameT = TypeVar("_FrameT")


def _map_frames_by_field(frames: Any, data_frames: Any) -> dict[str, Any]:
    """Return the classes of the frames in envelopes by the name of the envelope's field.

    :param frames: the union of all frames of a direction.
    :param data_frames: the union of the frames without envelope.
    """
    return {
        frame_class.__name__.lower(): frame_class
        for frame_class in get_args(frames)
        if frame_class not in get_args(data_frames)
    }


_CLIENT_FRAMES_BY_FIELD: Final[Mapping[str, type[ClientFrame]]] = _map_frames_by_field(
    ClientFrame, ClientData
)
_SERVER_FRAMES_BY_FIELD: Final[Mapping[str, type[ServerFrame]]] = _map_frames_by_field(
    ServerFrame, ServerData
)


def _load_envelope() -> Any:
    """Return the class that protobuf makes from the compiled envelope.proto."""
    # not a generated Python module, which would warn with the next major version of protobuf
    files = FileDescriptorSet.FromString(Path(__file__).with_name("envelope.binpb").read_bytes())
    pool = DescriptorPool()
    pool.Add(files.file[0])
    return GetMessageClass(pool.FindMessageTypeByName("cxbridge.blackboard.Envelope"))


_Envelope: Final[Any] = _load_envelope()


def encode(frame: Frame) -> bytes:
    """Return the bytes of a frame.

    :raises ProtocolError: if a text has no UTF-8 form, or a number does not fit its field.
    """
    try:
        if type(frame) in _DATA_FRAMES:
            return _encode(frame)
        fields = to_builtins(frame, builtin_types=(bytes,))
        number = fields.pop("number")
        body = {name: value for name, value in fields.items() if value is not None}
        envelope = _Envelope(version=VERSION, number=number, **{type(frame).__name__.lower(): body})
        frame_bytes: bytes = envelope.SerializeToString()
    except (ValueError, OverflowError) as error:  # UnicodeError is a ValueError
        raise ProtocolError(f"{type(frame).__name__} cannot be sent: {error}") from error
    return frame_bytes


def decode_client_frame(frame_bytes: bytes) -> ClientFrame:
    """Return the frame that a client has sent.

    :raises ProtocolError: if the bytes are invalid, exceed a limit, or have another version.
    """
    return _decode(frame_bytes, _decode_client_data, _CLIENT_FRAMES_BY_FIELD)


def decode_server_frame(frame_bytes: bytes) -> ServerFrame:
    """Return the frame that a server has sent.

    :raises ProtocolError: if the bytes are invalid, exceed a limit, or have another version.
    """
    return _decode(frame_bytes, _decode_server_data, _SERVER_FRAMES_BY_FIELD)


def _decode(
    frame_bytes: bytes, decode_data: Callable[[bytes], _FrameT], frames_by_field: Mapping[str, type[_FrameT]]
) -> _FrameT:
    try:
        if frame_bytes and frame_bytes[0] in _DATA_FIRST_BYTES:
            return decode_data(frame_bytes)
        envelope = _Envelope.FromString(frame_bytes)
    except (message.DecodeError, DecodeError, UnicodeError) as error:
        raise _make_invalid_error(error) from error
    if envelope.version != VERSION:
        raise ProtocolError(
            f"version {envelope.version} of the blackboard's protocol instead of version {VERSION}",
            hint=_VERSION_HINT,
        )
    field = envelope.WhichOneof("body")
    if field not in frames_by_field:
        raise _make_invalid_error(
            f"{field or 'an envelope without a frame'} is not allowed in this direction"
        )
    fields = _read_fields(getattr(envelope, field))
    try:
        return convert({**fields, "number": envelope.number}, frames_by_field[field])
    except ValidationError as error:
        raise _make_invalid_error(error) from error


def _read_fields(body: Any) -> dict[str, Any]:
    """Return the values of a protobuf message; None for an absent optional field."""
    values: dict[str, Any] = {}
    for field in body.DESCRIPTOR.fields:
        value = getattr(body, field.name)
        if not isinstance(value, (str, bytes, int)):  # the repeated fields, with texts or messages
            value = [item if isinstance(item, str) else _read_fields(item) for item in value]
        elif field.has_presence and not body.HasField(field.name):
            value = None
        values[field.name] = value
    return values


_VERSION_HINT: Final = "use the same version of cxbridge"


def _make_invalid_error(reason: object) -> ProtocolError:
    return ProtocolError(
        f"not a frame of version {VERSION} of the blackboard's protocol: {reason}", hint=_VERSION_HINT
    )
