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
    """Yield inputs of :func:`fawkes_stream`: frames of each kind, and two invalid frames."""
    from tests.support import TEST_FOLDERS  # noqa: PLC0415 - tests may be absent

    sys.path += TEST_FOLDERS  # the folder of the next import
    from fawkes_tests.network.samples import SAMPLES  # noqa: PLC0415

    # the first byte: 0 for a client and pieces of one byte, 7 for a server and pieces of four bytes
    for message in SAMPLES.values():
        yield b"\0" + message.to_bytes()
        yield b"\x07" + message.to_bytes() * 2
    # a valid frame, then the head of a blackboard frame (component 2, kind 1) with a payload above each limit
    yield b"\x01" + blackboard_messages.ListAll().to_bytes() + b"\0\2\0\1\xff\xff\xff\xff"
    # a frame of the unknown component 99, kind 1, with a payload of one byte
    yield b"\x03" + b"\0\x63\0\1\0\0\0\1x"


def fawkes_stream(data: bytes) -> None:
    """Split a stream into frames, at once and piece by piece with equal results, and decode each frame.

    :param data: a byte, then the stream. The lowest bit of the byte is 1 if a server reads the stream, 0 if a
        client reads it; the other bits are the size of the pieces minus one.
    :raises AssertionError: if pieces give other frames, the decoder stores too much, or a message changes.
    """
    if not data:
        return
    piece_size, stream = 1 + (data[0] >> 1), data[1:]
    find_limit: FindPayloadLimit = client_payload_limit
    if data[0] & 1:
        find_limit = _find_server_limit
    frames_and_end = list(_split(stream, len(stream) or 1, find_limit))
    assert list(_split(stream, piece_size, find_limit)) == frames_and_end, (
        "pieces give other frames than the whole"
    )
    for frame in frames_and_end:
        if isinstance(frame, FawkesFrame):
            _decode_fawkes(frame)


def _find_server_limit(component: int, kind: int) -> int:
    """Return the maximum payload size of a message to the fuzzed server, in bytes."""
    return server_payload_limit(component, kind, _MAX_BLOCK_SIZE)


def _split(stream: bytes, piece_size: int, find_limit: FindPayloadLimit) -> Iterator[FawkesFrame | str]:
    """Yield the frames of a stream, then a text about its end.

    The text is the message of the error that ended the stream, or says how many bytes of an incomplete frame
    the decoder stores.
    """
    decoder = FrameDecoder(find_limit)
    try:
        for start in range(0, len(stream), piece_size):
            yield from decoder.feed(stream[start : start + piece_size])
            _check_pending(decoder, stream)
    except FrameTooLongError as error:
        yield str(error)
    else:
        yield f"{decoder.pending_size} bytes left"


def _check_pending(decoder: FrameDecoder, stream: bytes) -> None:
    """Fail if the decoder stores more than one incomplete frame."""
    assert decoder.pending_size <= len(stream)
    assert decoder.pending_size < HEADER.size + fawkes.CLIENT_MESSAGE_LIMIT  # the greatest limit


def _decode_fawkes(frame: FawkesFrame) -> None:
    """Decode a frame, then encode and decode the message twice; fail if the second round trip changes it.

    The first round trip may change the message: a received text may fill its field without NUL, but an
    encoder cuts the text to make room for NUL.
    """
    try:
        encoded = fawkes.decode(frame).to_frame()
    except MalformedMessageError:
        return
    message = fawkes.decode(encoded)
    message_again = fawkes.decode(message.to_frame())
    # ASCII alone: an invalid byte of UTF-8 becomes a longer escape, which each encoding may cut
    if frame.payload.isascii():
        assert message_again == message, f"{message} changed to {message_again}"
