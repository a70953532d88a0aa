"""The target and the seeds for streams of Fawkes' protocol."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Final

from cxbridge_fawkes.network.errors import FrameTooLongError, MalformedMessageError
from cxbridge_fawkes.network.messages import blackboard as blackboard_messages
from cxbridge_fawkes.network.messages import codec as fawkes
from cxbridge_fawkes.network.messages.codec import client_payload_limit, server_payload_limit
from cxbridge_fawkes.network.messages.frames import HEADER, FawkesFrame, FindPayloadLimit, FrameDecoder

_MAX_BLOCK_SIZE: Final = 4096  # bytes of the largest block that the client may send to the fuzzed server


def fawkes_seeds() -> Iterator[bytes]:
    """Yield inputs of :func:`fawkes_stream`: frames of each kind, and two streams with an invalid frame."""
    from tests.support import TEST_FOLDERS  # noqa: PLC0415 - tests may be absent

    sys.path += TEST_FOLDERS  # the folder of the next import
    from fawkes_tests.network.samples import SAMPLES  # noqa: PLC0415

    for message in SAMPLES.values():
        yield b"\0" + message.to_bytes()
        yield b"\x07" + message.to_bytes() * 2
    yield b"\x01" + blackboard_messages.ListAll().to_bytes() + b"\0\2\0\1\xff\xff\xff\xff"
    yield b"\x03" + b"\0\x63\0\1\0\0\0\1x"


def fawkes_stream(data: bytes) -> None:
    """Split a stream into frames, whole and in pieces with equal results, and decode each frame.

    :param data: a byte with the size of the pieces and the kind of the reader, then the stream.
    """
    if not data:
        return
    piece_size, stream = 1 + (data[0] >> 1), data[1:]
    limit: FindPayloadLimit = client_payload_limit
    if data[0] & 1:
        limit = _limit_of_server
    frames = list(_split(stream, len(stream) or 1, limit))
    assert list(_split(stream, piece_size, limit)) == frames, "the pieces of a stream make other frames"
    for frame in frames:
        if isinstance(frame, FawkesFrame):
            _decode_fawkes(frame)


def _limit_of_server(component: int, kind: int) -> int:
    """Return the greatest length of the payload of a message to a server."""
    return server_payload_limit(component, kind, _MAX_BLOCK_SIZE)


def _split(stream: bytes, piece_size: int, limit: FindPayloadLimit) -> Iterator[FawkesFrame | str]:
    """Yield the frames of a stream, then a text: the error, or the number of left bytes."""
    decoder = FrameDecoder(limit)
    try:
        for start in range(0, len(stream), piece_size):
            yield from decoder.feed(stream[start : start + piece_size])
            _check_pending(decoder, stream, limit)
    except FrameTooLongError as error:
        yield str(error)
    else:
        yield f"{decoder.pending_size} bytes left"


def _check_pending(decoder: FrameDecoder, stream: bytes, limit: FindPayloadLimit) -> None:
    """Fail if the decoder stores more than one incomplete frame."""
    assert decoder.pending_size <= len(stream)
    assert decoder.pending_size < HEADER.size + max(limit(0, 0), fawkes.CLIENT_MESSAGE_LIMIT)


def _decode_fawkes(frame: FawkesFrame) -> None:
    """Decode a frame; for plain ASCII, encode and decode the message again without a change.

    Decoders are more liberal than encoders: a text may fill its field without NUL, and is cut by the first
    encoding. So only the second round trip must change nothing.
    """
    try:
        sent = fawkes.decode(frame).to_frame()
    except MalformedMessageError:
        return
    message = fawkes.decode(sent)
    again = fawkes.decode(message.to_frame())
    # escapes of bytes outside UTF-8 are longer, and are cut
    if frame.payload.isascii():
        assert again == message, f"{message} changed to {again}"
