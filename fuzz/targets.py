"""What is fuzzed: each target takes any bytes and fails by an exception that is not one of ours.

They are plain functions: a fuzzer drives them (``python -m fuzz``), and the tests replay what it found.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Final

from cxbridge.blackboard.fawkesnet.errors import FrameTooLongError, MalformedMessageError
from cxbridge.blackboard.fawkesnet.messages import codec as fawkes
from cxbridge.blackboard.fawkesnet.messages.codec import Message, limit_to_client, limit_to_server
from cxbridge.blackboard.fawkesnet.messages.configuration import ConfigList, ConfigMessage
from cxbridge.blackboard.fawkesnet.messages.frames import HEADER, FawkesFrame, FrameDecoder, Limit
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire import codec as envelope
from cxbridge.blackboard.zmq.wire import dataframes
from fuzz.sessions import zmq_sessions
from fuzz.skills import skill_strings

_BLOCK: Final = 4096  # bytes of the largest block that the fuzzed server's client may send
_MAX_FRAMES: Final = 4


def zmq_envelope(data: bytes) -> None:
    """Decode the frames of one message; what is accepted must survive another trip.

    :param data: see :func:`split_message`.
    """
    try:
        frame = envelope.decode(split_message(data))
    except ProtocolError:
        return
    if isinstance(frame.body, tuple):
        again = envelope.decode([repack(frame)])
        assert again == frame, f"{frame} became {again}"
        return
    frame.body.DiscardUnknownFields()
    fields = {field.name: value for field, value in frame.body.ListFields()}
    frames = [envelope.encode(frame.kind, frame.number, fields)]
    again = envelope.decode(frames if frame.block is None else [*frames, frame.block])
    assert again == frame, f"{frame} became {again}"


def repack(frame: dataframes.ZmqFrame) -> bytes:
    """Return the bytes of a data frame."""
    body, number, block = frame.body, frame.number, frame.block or b""
    match body:
        case dataframes.WriteBody():
            data = dataframes.pack_write(number, body.instance, body.stamp, body.changed, block)
        case dataframes.UpdateBody():
            data = dataframes.pack_update(*body, block)
        case dataframes.CreditBody():
            data = dataframes.pack_credit(number, body.updates)
        case dataframes.SendBody():
            data = dataframes.pack_send(number, body, block)
        case dataframes.DeliverBody():
            data = dataframes.pack_deliver(number, body, block)
        case dataframes.DeliveredBody():
            data = dataframes.pack_delivered(number, body)
        case _:
            data = dataframes.pack_answer(number, body)
    return data


def split_message(data: bytes) -> list[bytes]:
    """Return frames: the first byte says how many, two before each but the last say how long it is."""
    if not data:
        return []
    frames, rest = [], data[1:]
    for _ in range(data[0] % _MAX_FRAMES):
        size = int.from_bytes(rest[:2], "big")
        frames.append(rest[2 : 2 + size])
        rest = rest[2 + size :]
    return [*frames, rest]


def join_message(frames: list[bytes]) -> bytes:
    """Return the input from which :func:`split_message` makes ``frames``."""
    *before, last = frames
    return bytes([len(before)]) + b"".join(len(frame).to_bytes(2, "big") + frame for frame in before) + last


def fawkes_stream(data: bytes) -> None:
    """Cut a stream into frames, at once and in pieces with the same outcome, and decode each.

    :param data: a byte that says how the stream is dealt out and who reads it, then the stream.
    """
    if not data:
        return
    step, stream = 1 + (data[0] >> 1), data[1:]
    limit: Limit = limit_to_client
    if data[0] & 1:
        limit = _limit_of_server
    whole = list(_frames(stream, len(stream) or 1, limit))
    assert list(_frames(stream, step, limit)) == whole, "the same bytes in pieces are other frames"
    for frame in whole:
        if isinstance(frame, FawkesFrame):
            _decode_fawkes(frame)


def _limit_of_server(component: int, kind: int) -> int:
    return limit_to_server(component, kind, _BLOCK)


def _frames(stream: bytes, step: int, limit: Limit) -> Iterator[FawkesFrame | str]:
    """Yield the frames of a stream, and at last how it ended."""
    decoder = FrameDecoder(limit)
    try:
        for start in range(0, len(stream), step):
            yield from decoder.feed(stream[start : start + step])
            _check_pending(decoder, stream, limit)
    except FrameTooLongError as error:
        yield str(error)
    else:
        yield f"{decoder.pending} bytes left"


def _check_pending(decoder: FrameDecoder, stream: bytes, limit: Limit) -> None:
    """Fail when the decoder keeps more than one incomplete frame."""
    assert decoder.pending <= len(stream)
    assert decoder.pending < HEADER.size + max(limit(0, 0), fawkes.LIST_LIMIT)


def _decode_fawkes(frame: FawkesFrame) -> None:
    """Decode a frame; of plain ASCII, what this side makes of it must survive another trip.

    Readers are more liberal than writers: a text that fills its field comes without its NUL, and is cut when
    it is packed. So it is the second trip that must change nothing.
    """
    try:
        sent = fawkes.decode(frame).to_frame()
    except MalformedMessageError:
        return
    message = fawkes.decode(sent)
    again = fawkes.decode(message.to_frame())
    # bytes that are no UTF-8 become longer escapes, which are cut; NaN equals nothing
    if frame.payload.isascii() and not _has_nan(message):
        assert again == message, f"{message} became {again}"


def _has_nan(message: Message) -> bool:
    entries = message.entries if isinstance(message, ConfigList) else (message,)
    return any(
        isinstance(value, float) and math.isnan(value)
        for entry in entries
        if isinstance(entry, ConfigMessage)
        for value in entry.values
    )


TARGETS: Final[dict[str, Callable[[bytes], None]]] = {
    "zmq": zmq_envelope,
    "zmq-sessions": zmq_sessions,
    "fawkesnet": fawkes_stream,
    "skill-strings": skill_strings,
}
"""By the package under ``cxbridge.blackboard`` whose decoder, or server, it is; and skill strings."""
