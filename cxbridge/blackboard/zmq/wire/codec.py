"""Frames: bytes to a checked message and back. Knows the limits, knows no socket.

The protocol is in docs/evidence/protocol-zmq.md, the fields of envelopes in envelope.proto; data
frames are in :mod:`cxbridge.blackboard.zmq.wire.dataframes`.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from pathlib import Path
from typing import Any, Final

from google.protobuf.descriptor_pb2 import FileDescriptorSet
from google.protobuf.descriptor_pool import DescriptorPool
from google.protobuf.message import DecodeError
from google.protobuf.message_factory import GetMessageClass

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire.dataframes import (
    MAX_TEXT,
    VERSION,
    ZmqFrame,
    is_data_frame,
    other_version,
    unpack,
)

MAX_FRAME: Final = 1 << 20
"""Bytes of a frame that a server takes."""

MAX_ENVELOPE: Final = 64 << 10
"""Bytes of an envelope that a server takes."""

MAX_REPLY: Final = 64 << 20
"""Bytes of a frame that a client takes: lists are long."""

SESSION_SIZE: Final = 16
"""Bytes of a session, an epoch, an instance's serial."""


def _load() -> Any:
    """Return the class that protobuf makes of the compiled envelope.proto.

    A generated Python module would bind us to one major version of protobuf: it warns on the next one.
    """
    pool = DescriptorPool()
    files = FileDescriptorSet.FromString(Path(__file__).with_name("envelope.binpb").read_bytes())
    pool.AddSerializedFile(files.file[0].SerializeToString())
    return GetMessageClass(pool.FindMessageTypeByName("cxbridge.blackboard.Envelope"))


Envelope: Final[Any] = _load()
"""The protobuf class of the envelope."""


class ResultCode(IntEnum):
    """Outcome of a request, or why a session ended."""

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


class Stamp(IntEnum):
    """Whether a written block carries a new time stamp."""

    COMPARE = 0
    OLD = 1
    NEW = 2


class ChangeKind(IntEnum):
    """Who came or went."""

    NONE = 0
    READER_ADDED = 1
    READER_REMOVED = 2
    WRITER_ADDED = 3
    WRITER_REMOVED = 4


_MAY_HAVE_BLOCK: Final = frozenset({"reply"})
_TEXTS: Final = {
    "hello": ("name",),
    "open": ("owner", "type", "id"),
    "list": ("type_glob", "id_glob"),
    "change": ("owner",),
}
_SERIALS: Final = {
    "hello": ("session",),
    "open": ("hash",),
    "close": ("instance",),
    "welcome": ("epoch",),
    "change": ("instance",),
}


def encode(kind: str, number: int, body: dict[str, Any]) -> bytes:
    """Return an envelope's bytes.

    :param body: the fields of the body ``kind``.
    :raises ProtocolError: when a value does not fit its field, e.g. a text that has no UTF-8 form.
    """
    try:
        envelope = Envelope(version=VERSION, number=number, **{kind: body})
        data: bytes = envelope.SerializeToString()
    except (ValueError, TypeError, UnicodeError) as error:
        raise ProtocolError(f"{kind} cannot be sent: {error}") from error
    return data


def decode(frames: Sequence[bytes], *, max_envelope: int = MAX_ENVELOPE) -> ZmqFrame:
    """Return the values of one message's frames, without routing id.

    :raises ProtocolError: when they are not a message of this protocol, or beyond a limit.
    """
    if not 1 <= len(frames) <= 2:  # noqa: PLR2004 - envelope and block
        raise ProtocolError(f"a message has one or two frames, not {len(frames)}")
    if is_data_frame(frames[0]):
        if len(frames) > 1:
            raise ProtocolError("a data frame with another one behind it")
        return unpack(frames[0])
    if len(frames[0]) > max_envelope:
        raise ProtocolError(f"an envelope of {len(frames[0])} bytes, at most {max_envelope} are taken")
    envelope = Envelope()
    try:
        envelope.ParseFromString(frames[0])
    except (DecodeError, ValueError) as error:
        raise ProtocolError("not an envelope of the blackboard's protocol") from error
    if envelope.version != VERSION:
        raise other_version(envelope.version)
    kind = envelope.WhichOneof("body")
    if kind is None:
        raise ProtocolError("an envelope without a body")
    body = getattr(envelope, kind)
    block = frames[1] if len(frames) > 1 else None
    _check(kind, body, block)
    return ZmqFrame(kind, body, envelope.number, block)


def _check(kind: str, body: Any, block: bytes | None) -> None:
    """Refuse values that the types alone allow."""
    if block is not None and kind not in _MAY_HAVE_BLOCK:
        raise ProtocolError(f"{kind} with a block")
    for name in _SERIALS.get(kind, ()):
        if len(getattr(body, name)) != SESSION_SIZE:
            raise ProtocolError(f"{kind}.{name} has {len(getattr(body, name))} bytes, not {SESSION_SIZE}")
    for name in _TEXTS.get(kind, ()):
        if len(getattr(body, name)) > MAX_TEXT:
            raise ProtocolError(f"{kind}.{name} is longer than {MAX_TEXT}")
