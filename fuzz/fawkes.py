"""The target and the seeds for streams of Fawkes' protocol."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from typing import Final

from cxbridge_fawkes.network.errors import FrameTooLongError, MalformedMessageError
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import codec as fawkes
from cxbridge_fawkes.network.messages.codec import client_payload_limit, server_payload_limit
from cxbridge_fawkes.network.messages.frames import HEADER, FawkesFrame, FrameDecoder, Limit

_BLOCK: Final = 4096  # bytes of the largest block that the client may send to the fuzzed server


def fawkes_seeds() -> Iterator[bytes]:
    """Yield frames of each kind with payloads of usual sizes, and two invalid streams."""
    from tests.support import TEST_FOLDERS  # noqa: PLC0415 - tests may be absent

    sys.path += TEST_FOLDERS
    from fawkes_tests.network.samples import SAMPLES  # noqa: PLC0415

    for message in SAMPLES.values():
        yield b"\0" + message.to_bytes()
        yield b"\x07" + message.to_bytes() * 2
    yield b"\x01" + bb.ListAll().to_bytes() + b"\0\2\0\1\xff\xff\xff\xff"
    yield b"\x03" + b"\0\x63\0\1\0\0\0\1x"


def fawkes_stream(data: bytes) -> None:
    """Split a stream into frames, whole and in pieces with equal results, and decode each frame.

    :param data: a byte with the size of the pieces and the kind of the reader, then the stream.
    """
    if not data:
        return
    step, stream = 1 + (data[0] >> 1), data[1:]
    limit: Limit = client_payload_limit
    if data[0] & 1:
        limit = _limit_of_server
    whole = list(_frames(stream, len(stream) or 1, limit))
    assert list(_frames(stream, step, limit)) == whole, "the pieces of a stream make other frames"
    for frame in whole:
        if isinstance(frame, FawkesFrame):
            _decode_fawkes(frame)


def _limit_of_server(component: int, kind: int) -> int:
    return server_payload_limit(component, kind, _BLOCK)


def _frames(stream: bytes, step: int, limit: Limit) -> Iterator[FawkesFrame | str]:
    """Yield the frames of a stream, then the end of the stream."""
    decoder = FrameDecoder(limit)
    try:
        for start in range(0, len(stream), step):
            yield from decoder.feed(stream[start : start + step])
            _check_pending(decoder, stream, limit)
    except FrameTooLongError as error:
        yield str(error)
    else:
        yield f"{decoder.pending_size} bytes left"


def _check_pending(decoder: FrameDecoder, stream: bytes, limit: Limit) -> None:
    """Fail if the decoder stores more than one incomplete frame."""
    assert decoder.pending_size <= len(stream)
    assert decoder.pending_size < HEADER.size + max(limit(0, 0), fawkes.LIST_LIMIT)


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
