"""The envelope: what fits passes unchanged, whatever else comes is one of our errors."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.zmq import codec
from cxbridge.blackboard.zmq.codec import Envelope, decode, encode
from cxbridge.blackboard.zmq.errors import ProtocolError
from cxbridge.blackboard.zmq.protofile import describe

SERIAL = bytes(range(16))
NUMBERS = st.integers(0, 2**64 - 1)


@given(NUMBERS, NUMBERS, st.booleans(), st.booleans(), NUMBERS, st.binary(max_size=2000))
def test_what_is_encoded_is_decoded(channel, seq, stamped, changed, number, block):
    body = {"channel": channel, "seq": seq, "stamped": stamped, "changed": changed}
    frame = decode([encode("update", number, body), block])
    assert (frame.kind, frame.number, frame.block) == ("update", number, block)
    assert {name: getattr(frame.body, name) for name in body} == body


def test_the_bytes_on_the_wire_stay_as_they_are():
    body = {"channel": 3, "seq": 4, "stamped": True, "changed": True}
    assert encode("update", 0, body).hex() == "080182020808031004180120 01".replace(" ", "")
    assert encode("sync", 7, {"request": 9}).hex() == "080110077a020809"


def test_numbers_of_fields_are_unique():
    file = describe(Path(codec.__file__).with_name("envelope.proto"))
    assert len(file.message_type) == 23
    for message in file.message_type:
        numbers = [field.number for field in message.field]
        assert len(set(numbers)) == len(numbers), message.name


@given(st.lists(st.binary(max_size=300), max_size=4))
def test_random_bytes_are_refused_or_make_sense(frames):
    try:
        frame = decode(frames)
    except ProtocolError:
        return
    assert frame.kind


@given(st.data())
def test_damaged_envelopes_are_refused_or_make_sense(data):
    body = {"request": 5, "instance": SERIAL, "type": "AddMessage", "id": 3, "source": SERIAL, "thread": "t"}
    good = bytearray(encode("send", 1, body))
    for _ in range(data.draw(st.integers(1, 4))):
        position = data.draw(st.integers(0, len(good) - 1))
        match data.draw(st.integers(0, 2)):
            case 0:
                good[position] = data.draw(st.integers(0, 255))
            case 1:
                del good[position:]
            case _:
                good[position:position] = data.draw(st.binary(min_size=1, max_size=9))
        if not good:
            break
    try:
        frame = decode([bytes(good), b"block"])
    except ProtocolError:
        return
    assert frame.block == b"block"


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        ([], "one or two frames, not 0"),
        ([b"", b"", b""], "one or two frames, not 3"),
        ([b"x" * (codec.MAX_ENVELOPE + 1)], "at most 65536"),
        ([b"GET / HTTP/1.1\r\n\r\n"], "not an envelope"),
        ([b""], "version 0"),
        ([Envelope(version=2, beat={}).SerializeToString()], "version 2"),
        ([Envelope(version=1).SerializeToString()], "without a body"),
        ([encode("beat", 1, {}), b"block"], "beat with a block"),
        ([encode("write", 1, {"instance": SERIAL})], "write without its block"),
        ([encode("write", 1, {"instance": b"short"}), b""], "write.instance has 5 bytes, not 16"),
        ([encode("hello", 0, {"session": SERIAL, "name": "n" * 257})], "hello.name is longer than 256"),
    ],
)
def test_what_is_refused(frames, text):
    with pytest.raises(ProtocolError, match=text):
        decode(frames)


def test_a_text_without_utf8_form_is_not_sent():
    with pytest.raises(ProtocolError, match="open cannot be sent"):
        encode("open", 1, {"owner": "\ud800"})
