"""Messages to bytes and back: fixed bytes with their JSON twins, and anything at all."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.events import Level
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages import configuration as config
from cxbridge_fawkes.network.messages import plugins as plugin
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.messages.logger import LogMessage
from fawkes_tests.network.recordings import TRACES, frames_of
from fawkes_tests.network.samples import SAMPLES, to_json
from tests.support import needs_shared

DATA = Path(__file__).parent / "data"


@pytest.mark.parametrize("name", sorted(SAMPLES))
def test_the_bytes_of_each_message(name):
    message = SAMPLES[name]
    raw = (DATA / f"{name}.bin").read_bytes()
    assert message.to_bytes() == raw
    (frame,) = frames_of(raw)
    assert codec.decode(frame) == message
    twin = {"component": frame.component, "kind": frame.kind, **to_json(message)}
    assert twin == json.loads((DATA / f"{name}.json").read_text())


def test_there_is_no_byte_file_without_a_message():
    assert {path.stem for path in DATA.iterdir()} == set(SAMPLES)


@needs_shared
@pytest.mark.parametrize("path", sorted(TRACES.glob("*.bin")), ids=lambda path: path.name)
def test_what_a_real_fawkes_sent(path):
    for frame in frames_of(path.read_bytes()):
        again = codec.decode(frame).to_frame()
        if frame[:2] == (ComponentId.BLACKBOARD, bb.BoardKind.INTERFACE_CREATED):
            assert codec.decode(again) == codec.decode(frame)  # Fawkes leaves garbage after the NUL
        else:
            assert again == frame


@given(st.sampled_from(list(ComponentId)), st.integers(0, 60), st.binary(max_size=400))
def test_any_bytes_are_a_message_or_malformed(component, kind, payload):
    frame = FawkesFrame(component, kind, payload)
    try:
        message = codec.decode(frame)
    except MalformedMessageError:
        return
    assert codec.decode(message.to_frame()) == message or "nan" in repr(message)


@given(st.sampled_from(sorted(SAMPLES)), st.data())
def test_any_change_of_a_message_is_a_message_or_malformed(name, data):
    frame = SAMPLES[name].to_frame()
    raw = bytearray(frame.payload)
    for _ in range(data.draw(st.integers(1, 3))):
        at = data.draw(st.integers(0, len(raw)))
        raw[at : at + data.draw(st.integers(0, 4))] = data.draw(st.binary(max_size=4))
    try:
        codec.decode(frame._replace(payload=bytes(raw)))
    except ProtocolError as error:
        assert error.message  # noqa: PT017 - what is not malformed is fine, too


texts = st.text(st.characters(exclude_characters="\0", exclude_categories=["Cs"]))


@given(
    st.integers(0, 2**63 // 10**6),
    st.sampled_from(Level),
    texts,
    texts,
    st.booleans(),
)
def test_log_messages(time_us, level, component, text, exception):
    message = LogMessage(time_us, level, component, text, exception)
    assert codec.decode(message.to_frame()) == message


@given(st.sampled_from(sorted(config.SET_TYPES | config.VALUE_TYPES)), st.data(), st.booleans())
def test_values_of_the_configuration(kind, data, is_list):
    strategy = {
        "FLOAT": st.floats(width=32, allow_nan=False),
        "UINT": st.integers(0, 2**32 - 1),
        "INT": st.integers(-(2**31), 2**31 - 1),
        "BOOL": st.booleans(),
        "STRING": texts,
    }[kind.name.removeprefix("SET_").removesuffix("_VALUE")]
    values = data.draw(st.lists(strategy, min_size=1, max_size=5 if is_list else 1).map(tuple))
    message = config.ConfigMessage(kind, "/some/path", values, is_list)
    assert codec.decode(message.to_frame()) == message


def test_long_names_are_cut_where_a_client_needs_the_nul():
    event = bb.InterfaceEvent(bb.BoardKind.INTERFACE_CREATED, "T" * 48, "i" * 64)
    told = codec.decode(event.to_frame())
    assert told == bb.InterfaceEvent(bb.BoardKind.INTERFACE_CREATED, "T" * 47, "i" * 63)
    assert plugin.PluginMessage(plugin.PluginKind.LOADED, "n" * 40).pack() == b"n" * 31 + b"\0"


@pytest.mark.parametrize(
    ("component", "kind", "payload", "text"),
    [
        (9, 0, b"", "no component 9"),
        (2, 7, b"", "no messages of kind 7"),
        (1, 77, b"", "no messages of kind 77"),
        (3, 9, b"", "no messages of kind 9"),
        (4, 9, b"", "no messages of kind 9"),
        (2, 0, b"x", "LIST_ALL has 1 bytes, not 0"),
        (2, 2, b"x" * 127, "OPEN has 127 bytes, not 128"),
        (2, 1, bytes(7), "at least 8"),
        (2, 1, b"\0\0\0\x05\0\0\0\x01" + bytes(4), "announces 5 bytes, but has 4"),
        (2, 1, b"\0\0\0\x02\0\0\0\x01\0\x09", "ends within an element"),
        (2, 1, b"\0\0\0\x01\0\0\0\x01\0", "within the length"),
        (2, 1, b"\0\0\0\0\0\0\0\x01", "announces 1 elements, but has 0"),
        (2, 9, bytes(16) + b"\0\0\0\x05" + bytes(4), "DATA has 24 bytes, not 25"),
        (4, 3, bytes(18) + b"\0", "two texts"),
        (4, 3, b"\x07" + bytes(17), "level 7"),
        (3, 11, bytes(132) + b"\0", "not 4"),
        (3, 14, bytes(132) + b"\x05\0\0\0abc", "not 5"),
    ],
)
def test_what_makes_no_sense_is_named(component, kind, payload, text):
    with pytest.raises(MalformedMessageError, match=text):
        codec.decode(FawkesFrame(component, kind, payload))
