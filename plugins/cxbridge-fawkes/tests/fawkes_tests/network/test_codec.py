"""Encoding and decoding of messages: stored bytes with their JSON forms, recordings and random bytes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from fawkes_tests.network.recordings import TRACES, frames_of
from fawkes_tests.network.samples import SAMPLES, to_json
from tests.support import needs_shared

DATA = Path(__file__).parent / "data"


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_message_has_stored_bytes_and_json(name):
    message = SAMPLES[name]
    raw = (DATA / f"{name}.bin").read_bytes()
    assert message.to_bytes() == raw
    (frame,) = frames_of(raw)
    if frame.component == ComponentId.BLACKBOARD:
        assert codec.decode(frame) == message
    document = {"component": frame.component, "kind": frame.kind, **to_json(message)}
    assert document == json.loads((DATA / f"{name}.json").read_text())


def test_each_byte_file_has_message():
    assert {path.stem for path in DATA.iterdir()} == set(SAMPLES)


@needs_shared
@pytest.mark.parametrize("path", sorted(TRACES.glob("*.bin")), ids=lambda path: path.name)
def test_recorded_frames_survive_decoding_and_encoding(path):
    for frame in frames_of(path.read_bytes()):
        if frame.component != ComponentId.BLACKBOARD:
            continue  # the replays compare the other components
        encoded = codec.decode(frame).to_frame()
        if frame[:2] == (ComponentId.BLACKBOARD, bb.BoardKind.INTERFACE_CREATED):
            assert codec.decode(encoded) == codec.decode(frame)  # Fawkes leaves garbage after the NUL
        else:
            assert encoded == frame


@given(st.integers(0, 20), st.binary(max_size=400))
def test_random_bytes_are_message_or_malformed(kind, payload):
    frame = FawkesFrame(ComponentId.BLACKBOARD, kind, payload)
    try:
        message = codec.decode(frame)
    except MalformedMessageError:
        return
    assert codec.decode(message.to_frame()) == message


@given(st.sampled_from(sorted(name for name in SAMPLES if name.startswith("bb"))), st.data())
def test_changed_message_is_message_or_malformed(name, data):
    frame = SAMPLES[name].to_frame()
    raw = bytearray(frame.payload)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(raw)))
        raw[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    try:
        codec.decode(frame._replace(payload=bytes(raw)))
    except ProtocolError as error:
        assert error.message  # noqa: PT017 - a changed message may be valid


def test_long_names_end_with_nul():
    event = bb.InterfaceEvent(bb.BoardKind.INTERFACE_CREATED, "T" * 48, "i" * 64)
    decoded = codec.decode(event.to_frame())
    assert decoded == bb.InterfaceEvent(bb.BoardKind.INTERFACE_CREATED, "T" * 47, "i" * 63)


@pytest.mark.parametrize(
    ("component", "kind", "payload", "text"),
    [
        (9, 0, b"", "component 9 of the protocol has no messages of kind 0"),
        (2, 7, b"", "no messages of kind 7"),
        (2, 0, b"x", "LIST_ALL has 1 bytes, not 0"),
        (2, 2, b"x" * 127, "OPEN has 127 bytes, not 128"),
        (2, 1, bytes(7), "at least 8"),
        (2, 1, b"\0\0\0\x05\0\0\0\x01" + bytes(4), "announces 5 bytes, but has 4"),
        (2, 1, b"\0\0\0\x02\0\0\0\x01\0\x09", "ends within an element"),
        (2, 1, b"\0\0\0\x01\0\0\0\x01\0", "within the length"),
        (2, 1, b"\0\0\0\0\0\0\0\x01", "announces 1 elements, but has 0"),
        (2, 9, bytes(16) + b"\0\0\0\x05" + bytes(4), "DATA has 24 bytes, not 25"),
    ],
)
def test_malformed_message_is_error_with_reason(component, kind, payload, text):
    with pytest.raises(MalformedMessageError, match=text):
        codec.decode(FawkesFrame(component, kind, payload))
