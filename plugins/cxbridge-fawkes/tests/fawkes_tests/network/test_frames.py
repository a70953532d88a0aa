"""Decoding of a byte stream into frames."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cxbridge_fawkes.network.errors import FrameTooLongError
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder

frames = st.builds(FawkesFrame, st.integers(0, 65535), st.integers(0, 65535), st.binary(max_size=40))


def no_limit(component: int, kind: int) -> int:
    return 2**32


@given(st.lists(frames, max_size=8), st.data())
def test_decoder_returns_frames_of_any_chunks(sent, data):
    stream = b"".join(frame.to_bytes() for frame in sent)
    decoder = FrameDecoder(no_limit)
    received: list[FawkesFrame] = []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        received += decoder.feed(stream[:size])
        stream = stream[size:]
    assert received == sent
    assert decoder.pending_size == 0


@given(st.lists(st.binary(max_size=60)))
def test_random_bytes_are_frames_or_too_long(chunks):
    limit = 100
    decoder = FrameDecoder(lambda component, kind: limit)
    try:
        for chunk in chunks:
            for frame in decoder.feed(chunk):
                assert len(frame.payload) <= limit
            assert decoder.pending_size < limit + 8
    except FrameTooLongError as error:
        assert "only 100 are allowed" in error.message  # noqa: PT017 - the error is optional


def test_frame_can_change_limit_of_next_frame():
    limits = iter([0, 5])
    decoder = FrameDecoder(lambda component, kind: next(limits))
    stream = FawkesFrame(2, 2).to_bytes() + FawkesFrame(2, 10, b"12345").to_bytes()
    assert [len(frame.payload) for frame in decoder.feed(stream)] == [0, 5]
