"""Data frames: frequent messages with a header of fixed size and a block in one frame.

The layouts are described in docs/evidence/protocol-zmq.md.
"""

from __future__ import annotations

from collections.abc import Callable
from struct import Struct
from typing import Any, Final, NamedTuple

from cxbridge.blackboard.kit.errors import ProtocolError

VERSION: Final = 2
"""The version of the protocol, contained in each data frame and envelope."""

MAX_TEXT: Final = 256
"""The maximal bytes of the names of owners, threads and clients, and of patterns."""

WRITE: Final = 0xC1  # first bytes above those of envelopes, by which frames are distinguished
UPDATE: Final = 0xC2
CREDIT: Final = 0xC3
SEND: Final = 0xC4
DELIVER: Final = 0xC5
DELIVERED: Final = 0xC6
ANSWER: Final = 0xC7

WRITE_HEADER: Final = Struct("<BBB?4xQ16s")
"""Kind, version, stamp, changed, number, instance."""

UPDATE_HEADER: Final = Struct("<BB??4xQQQ")
"""Kind, version, stamped, changed, channel, seq, skipped."""

_CREDIT: Final = Struct("<BB2xIQ")
_SEND: Final = Struct("<BB2xIIHHQQ16s16s")
_DELIVER: Final = Struct("<BB2xIIHHQQ16s16s16s")
_OUTCOME: Final = Struct("<BBH4xQQQ")


class WriteBody(NamedTuple):
    """The block of a writer, see :class:`~cxbridge.blackboard.zmq.wire.codec.Stamp`."""

    instance: bytes
    stamp: int
    changed: bool


class UpdateBody(NamedTuple):
    """The block after write ``seq``; ``skipped`` earlier writes were not sent."""

    channel: int
    seq: int
    stamped: bool
    changed: bool
    skipped: int


class CreditBody(NamedTuple):
    """The number of handled updates."""

    updates: int


class SendBody(NamedTuple):
    """A message from a reader; ``instance`` is the sender's serial, ``source`` the first sender's."""

    request: int
    instance: bytes
    source: bytes
    type: str
    id: int
    thread: str
    hops: int


class DeliverBody(NamedTuple):
    """A message to the writer ``instance``."""

    delivery: int
    instance: bytes
    source: bytes
    sender: bytes
    type: str
    id: int
    thread: str
    hops: int


class DeliveredBody(NamedTuple):
    """The outcome of a message at the writer's client; ``code`` is a `ResultCode`."""

    delivery: int
    code: int
    detail: int


class AnswerBody(NamedTuple):
    """The outcome of a message for its sender; ``text`` is for log lines."""

    request: int
    code: int
    detail: int
    text: str


class ZmqFrame(NamedTuple):
    """A decoded message.

    :param kind: the name of the body, e.g. ``open``.
    :param body: a protobuf message, or the values of a data frame.
    :param number: the number of the frame in its session, 0 without one.
    :param block: the data, if any.
    """

    kind: str
    body: Any
    number: int
    block: bytes | None


def pack_write(number: int, instance: bytes, stamp: int, changed: bool, block: bytes) -> bytes:
    return WRITE_HEADER.pack(WRITE, VERSION, stamp, changed, number, instance) + block


def pack_update(channel: int, seq: int, stamped: bool, changed: bool, skipped: int, block: bytes) -> bytes:
    return UPDATE_HEADER.pack(UPDATE, VERSION, stamped, changed, channel, seq, skipped) + block


def pack_credit(number: int, updates: int) -> bytes:
    return _CREDIT.pack(CREDIT, VERSION, updates, number)


def pack_send(number: int, body: SendBody, block: bytes) -> bytes:
    """Return the bytes of a Send.

    :raises ProtocolError: if a text is too long or has no UTF-8 form.
    """
    type_, thread = _texts(body)
    header = _SEND.pack(
        SEND,
        VERSION,
        body.hops,
        body.id,
        len(type_),
        len(thread),
        number,
        body.request,
        body.instance,
        body.source,
    )
    return b"".join((header, type_, thread, block))


def pack_deliver(number: int, body: DeliverBody, block: bytes) -> bytes:
    """Return the bytes of a Deliver.

    :raises ProtocolError: if a text is too long or has no UTF-8 form.
    """
    type_, thread = _texts(body)
    header = _DELIVER.pack(
        DELIVER,
        VERSION,
        body.hops,
        body.id,
        len(type_),
        len(thread),
        number,
        body.delivery,
        body.instance,
        body.source,
        body.sender,
    )
    return b"".join((header, type_, thread, block))


def pack_delivered(number: int, body: DeliveredBody) -> bytes:
    return _OUTCOME.pack(DELIVERED, VERSION, body.code, number, body.delivery, body.detail)


def pack_answer(number: int, body: AnswerBody) -> bytes:
    header = _OUTCOME.pack(ANSWER, VERSION, body.code, number, body.request, body.detail)
    return header + body.text.encode(errors="replace")


def _texts(body: SendBody | DeliverBody) -> tuple[bytes, bytes]:
    """Return the encoded type and thread name of a message."""
    try:
        texts = body.type.encode(), body.thread.encode()
    except UnicodeError as error:
        raise ProtocolError(f"a message cannot be sent: {error}") from error
    if len(texts[0]) > MAX_TEXT or len(texts[1]) > MAX_TEXT:
        raise ProtocolError(f"a message cannot be sent: a name is longer than {MAX_TEXT} bytes")
    return texts


def is_data_frame(data: bytes) -> bool:
    """Return whether a frame is a data frame, by its first byte."""
    return WRITE <= data[0] <= ANSWER if data else False


def unpack(data: bytes) -> ZmqFrame:
    """Decode a data frame.

    :raises ProtocolError: if its size or version is wrong.
    """
    kind, header, read = _KINDS[data[0]]
    if len(data) < header.size:
        raise ProtocolError(f"{kind} of {len(data)} bytes, its header has {header.size}")
    if data[1] != VERSION:
        raise other_version(data[1])
    return read(kind, data)


def other_version(version: int) -> ProtocolError:
    """Return the error for a peer of another version."""
    return ProtocolError(
        f"version {version} of the blackboard's protocol, here is version {VERSION}",
        hint="let both sides run the same version of cxbridge",
    )


def _write(kind: str, data: bytes) -> ZmqFrame:
    _, _, stamp, changed, number, instance = WRITE_HEADER.unpack_from(data)
    return ZmqFrame(kind, WriteBody(instance, stamp, changed), number, data[WRITE_HEADER.size :])


def _update(kind: str, data: bytes) -> ZmqFrame:
    _, _, stamped, changed, channel, seq, skipped = UPDATE_HEADER.unpack_from(data)
    return ZmqFrame(kind, UpdateBody(channel, seq, stamped, changed, skipped), 0, data[UPDATE_HEADER.size :])


def _credit(kind: str, data: bytes) -> ZmqFrame:
    _check_end(kind, data, _CREDIT)
    _, _, updates, number = _CREDIT.unpack(data)
    return ZmqFrame(kind, CreditBody(updates), number, None)


def _send(kind: str, data: bytes) -> ZmqFrame:
    _, _, hops, id_, type_size, thread_size, number, request, instance, source = _SEND.unpack_from(data)
    type_, thread, block = _tail(kind, data, _SEND.size, type_size, thread_size)
    return ZmqFrame(kind, SendBody(request, instance, source, type_, id_, thread, hops), number, block)


def _deliver(kind: str, data: bytes) -> ZmqFrame:
    _, _, hops, id_, type_size, thread_size, *parts = _DELIVER.unpack_from(data)
    number, delivery, instance, source, sender = parts
    type_, thread, block = _tail(kind, data, _DELIVER.size, type_size, thread_size)
    return ZmqFrame(
        kind, DeliverBody(delivery, instance, source, sender, type_, id_, thread, hops), number, block
    )


def _delivered(kind: str, data: bytes) -> ZmqFrame:
    _check_end(kind, data, _OUTCOME)
    _, _, code, number, delivery, detail = _OUTCOME.unpack(data)
    return ZmqFrame(kind, DeliveredBody(delivery, code, detail), number, None)


def _answer(kind: str, data: bytes) -> ZmqFrame:
    _, _, code, number, request, detail = _OUTCOME.unpack_from(data)
    text = data[_OUTCOME.size :].decode(errors="replace")
    return ZmqFrame(kind, AnswerBody(request, code, detail, text), number, None)


def _check_end(kind: str, data: bytes, header: Struct) -> None:
    if len(data) != header.size:
        raise ProtocolError(f"{kind} of {len(data)} bytes, not {header.size}")


def _tail(kind: str, data: bytes, start: int, type_size: int, thread_size: int) -> tuple[str, str, bytes]:
    """Return the type, thread name and block after a header."""
    if type_size > MAX_TEXT or thread_size > MAX_TEXT:
        raise ProtocolError(f"{kind}: a name is longer than {MAX_TEXT}")
    middle = start + type_size
    end = middle + thread_size
    if len(data) < end:
        raise ProtocolError(f"{kind} of {len(data)} bytes, its names need {end}")
    try:
        return data[start:middle].decode(), data[middle:end].decode(), data[end:]
    except UnicodeError as error:
        raise ProtocolError(f"{kind}: a name is not UTF-8") from error


_KINDS: Final[dict[int, tuple[str, Struct, Callable[[str, bytes], ZmqFrame]]]] = {
    WRITE: ("write", WRITE_HEADER, _write),
    UPDATE: ("update", UPDATE_HEADER, _update),
    CREDIT: ("credit", _CREDIT, _credit),
    SEND: ("send", _SEND, _send),
    DELIVER: ("deliver", _DELIVER, _deliver),
    DELIVERED: ("delivered", _OUTCOME, _delivered),
    ANSWER: ("answer", _OUTCOME, _answer),
}
