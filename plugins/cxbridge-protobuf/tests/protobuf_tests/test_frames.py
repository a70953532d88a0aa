"""Encoding and decoding of frames."""

from __future__ import annotations

import contextlib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import (
    Frame,
    StreamDecoder,
    add_header,
    decode_datagram,
    decode_payload,
    encode_frame,
)

NUMBERS = st.integers(0, 65535)
FRAMES = st.builds(Frame, NUMBERS, NUMBERS, st.binary(max_size=60))


def test_frame_has_documented_bytes():
    assert encode_frame(Frame(2000, 1, b"abc")).hex() == "020000000000000707d00001616263"


@given(st.lists(FRAMES, max_size=6), st.data())
def test_stream_decoder_returns_frames_of_any_chunks(frames, data):
    stream = b"".join(encode_frame(frame) for frame in frames)
    decoder = StreamDecoder(100)
    decoded: list[Frame] = []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        decoded += decoder.feed(stream[:size])
        stream = stream[size:]
    assert decoded == frames


@given(FRAMES)
def test_datagram_decodes_to_its_frame(frame):
    cipher, content = decode_datagram(encode_frame(frame))
    assert (cipher, decode_payload(content)) == (0, frame)


@given(st.binary(max_size=200))
def test_garbage_gives_frames_or_protobuf_error(garbage):
    decoder = StreamDecoder(50)
    with contextlib.suppress(ProtobufError):
        for frame in decoder.feed(garbage):
            assert len(frame.encoded_message) <= 50
    with contextlib.suppress(ProtobufError):
        decode_payload(decode_datagram(garbage)[1])


@pytest.mark.parametrize(
    ("start", "problem"),
    [
        ("02000000 ffffffff", "4294967295 bytes"),
        ("02000000 00000003", "3 bytes"),
        ("01000000 00000008", "no frames of version 2"),
        ("02020000 00000020", "encrypted"),
    ],
)
def test_invalid_header_is_refused_without_payload(start, problem):
    with pytest.raises(ProtobufError, match=problem):
        list(StreamDecoder(1000).feed(bytes.fromhex(start)))


def test_frames_before_broken_frame_are_returned():
    valid = Frame(1, 2, b"x")
    frames = StreamDecoder(1000).feed(encode_frame(valid) + b"\xff" * 8)
    assert next(frames) == valid
    with pytest.raises(ProtobufError):
        next(frames)


def test_encrypted_datagram_may_differ_from_header_size():
    sealed = bytearray(add_header(2, b"0123456789abcdef"))
    sealed[7] = 3
    assert decode_datagram(bytes(sealed)) == (2, b"0123456789abcdef")


@pytest.mark.parametrize(
    "data", [b"", b"\x02\0\0\0\0\0", encode_frame(Frame(1, 2, b"abc"))[:-1], b"\x03" + b"\0" * 11]
)
def test_invalid_datagram_is_refused(data):
    with pytest.raises(ProtobufError):
        decode_payload(decode_datagram(data)[1])
