"""Cutting a stream into frames."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from cxbridge_fawkes.network.errors import FrameTooLongError
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder

frames = st.builds(FawkesFrame, st.integers(0, 65535), st.integers(0, 65535), st.binary(max_size=40))


def no_limit(component: int, kind: int) -> int:
    return 2**32


@given(st.lists(frames, max_size=8), st.data())
def test_however_the_bytes_are_dealt_out(sent, data):
    stream = b"".join(frame.to_bytes() for frame in sent)
    decoder = FrameDecoder(no_limit)
    got: list[FawkesFrame] = []
    while stream:
        size = data.draw(st.integers(1, len(stream)))
        got += decoder.feed(stream[:size])
        stream = stream[size:]
    assert got == sent
    assert decoder.pending_size == 0


@given(st.lists(st.binary(max_size=60)))
def test_any_bytes_are_frames_or_too_long(chunks):
    limit = 100
    decoder = FrameDecoder(lambda component, kind: limit)
    try:
        for chunk in chunks:
            for frame in decoder.feed(chunk):
                assert len(frame.payload) <= limit
            assert decoder.pending_size < limit + 8
    except FrameTooLongError as error:
        assert "only 100 are allowed" in error.message  # noqa: PT017 - need not be raised


def test_a_frame_may_change_the_limit_of_the_next():
    limits = iter([0, 5])
    decoder = FrameDecoder(lambda component, kind: next(limits))
    stream = FawkesFrame(2, 2).to_bytes() + FawkesFrame(2, 10, b"12345").to_bytes()
    assert [len(frame.payload) for frame in decoder.feed(stream)] == [0, 5]
