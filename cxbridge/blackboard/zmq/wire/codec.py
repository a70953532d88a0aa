"""Encoding and checked decoding of frames.

The protocol is described in docs/evidence/protocol-zmq.md, the envelopes in envelope.proto. Data frames are
in :mod:`cxbridge.blackboard.zmq.wire.dataframes`.
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
"""The maximal bytes of a frame to the server."""

MAX_ENVELOPE: Final = 64 << 10
"""The maximal bytes of an envelope to the server."""

# lists of interfaces can be long
MAX_REPLY: Final = 64 << 20
"""The maximal bytes of a frame to a client."""

SESSION_SIZE: Final = 16
"""The bytes of the ids of sessions, epochs and instances."""


def _load() -> Any:
    """Return the class that protobuf makes from the compiled envelope.proto."""
    # a generated Python module warns with the next major version of protobuf
    pool = DescriptorPool()
    files = FileDescriptorSet.FromString(Path(__file__).with_name("envelope.binpb").read_bytes())
    pool.AddSerializedFile(files.file[0].SerializeToString())
    return GetMessageClass(pool.FindMessageTypeByName("cxbridge.blackboard.Envelope"))


Envelope: Final[Any] = _load()


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


class Stamp(IntEnum):
    """Whether a written block carries a new time stamp."""

    COMPARE = 0
    OLD = 1
    NEW = 2


class ChangeKind(IntEnum):
    """How the members of an interface changed."""

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
    """Return the bytes of an envelope.

    :param body: the fields of the body ``kind``.
    :raises ProtocolError: if a value does not fit its field, e.g. a text without UTF-8 form.
    """
    try:
        envelope = Envelope(version=VERSION, number=number, **{kind: body})
        data: bytes = envelope.SerializeToString()
    except (ValueError, TypeError, UnicodeError) as error:
        raise ProtocolError(f"{kind} cannot be sent: {error}") from error
    return data


def decode(frames: Sequence[bytes], *, max_envelope: int = MAX_ENVELOPE) -> ZmqFrame:
    """Return the decoded frames of one message, without routing id.

    :raises ProtocolError: if they are invalid or exceed a limit.
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
    """Check the values that the types of the fields do not restrict."""
    if block is not None and kind not in _MAY_HAVE_BLOCK:
        raise ProtocolError(f"{kind} with a block")
    for name in _SERIALS.get(kind, ()):
        if len(getattr(body, name)) != SESSION_SIZE:
            raise ProtocolError(f"{kind}.{name} has {len(getattr(body, name))} bytes, not {SESSION_SIZE}")
    for name in _TEXTS.get(kind, ()):
        if len(getattr(body, name)) > MAX_TEXT:
            raise ProtocolError(f"{kind}.{name} is longer than {MAX_TEXT}")
