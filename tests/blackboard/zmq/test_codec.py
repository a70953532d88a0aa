"""Frames: what fits passes unchanged, whatever else comes is one of our errors."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire import codec
from cxbridge.blackboard.zmq.wire.codec import Envelope, decode, encode
from cxbridge.blackboard.zmq.wire.dataframes import (
    VERSION,
    AnswerBody,
    CreditBody,
    DeliverBody,
    DeliveredBody,
    SendBody,
    UpdateBody,
    WriteBody,
    ZmqFrame,
    pack_credit,
    pack_send,
    pack_update,
    pack_write,
)
from fuzz.targets import repack
from tests.support import ROOT

SERIAL = bytes(range(16))
NUMBERS = st.integers(0, 2**64 - 1)


SERIALS = st.binary(min_size=16, max_size=16)
WORDS = st.integers(0, 2**32 - 1)
NAMES = st.text(st.characters(codec="utf-8"), max_size=60)
OUTCOMES = st.integers(0, 2**16 - 1)
BODIES = st.one_of(
    st.builds(WriteBody, SERIALS, st.integers(0, 255), st.booleans()),
    st.builds(UpdateBody, NUMBERS, NUMBERS, st.booleans(), st.booleans(), NUMBERS),
    st.builds(CreditBody, WORDS),
    st.builds(SendBody, NUMBERS, SERIALS, SERIALS, NAMES, WORDS, NAMES, WORDS),
    st.builds(DeliverBody, NUMBERS, SERIALS, SERIALS, SERIALS, NAMES, WORDS, NAMES, WORDS),
    st.builds(DeliveredBody, NUMBERS, OUTCOMES, NUMBERS),
    st.builds(AnswerBody, NUMBERS, OUTCOMES, NUMBERS, NAMES),
)


@given(NUMBERS, st.binary(max_size=2000))
def test_an_envelope_that_is_encoded_is_decoded(number, epoch):
    body = {"request": number, "text": "x", "detail": 3, "hash": epoch}
    frame = decode([encode("reply", number, body), b"block"])
    assert (frame.kind, frame.number, frame.block) == ("reply", number, b"block")
    assert {name: getattr(frame.body, name) for name in body} == body


@given(BODIES, NUMBERS, st.binary(max_size=2000))
def test_a_data_frame_that_is_packed_is_unpacked(body, number, block):
    packed = repack(ZmqFrame("", body, number, block))
    frame = decode([packed])
    assert frame.kind == type(body).__name__.removesuffix("Body").lower()
    assert frame.body == body
    assert frame.number == (0 if isinstance(body, UpdateBody) else number)
    assert frame.block in (None, block)
    assert (frame.block is None) is isinstance(body, CreditBody | DeliveredBody | AnswerBody)


@given(BODIES, st.data())
def test_damaged_data_frames_are_refused_or_make_sense(body, data):
    packed = bytearray(repack(ZmqFrame("", body, 1, b"block")))
    for _ in range(data.draw(st.integers(1, 4))):
        packed[data.draw(st.integers(0, len(packed) - 1))] = data.draw(st.integers(0, 255))
    del packed[data.draw(st.integers(1, len(packed))) :]
    try:
        frame = decode([bytes(packed)])
    except ProtocolError:
        return
    assert frame.kind


def test_the_bytes_on_the_wire_stay_as_they_are():
    assert encode("sync", 7, {"request": 9}).hex() == "080210077a020809"
    assert (
        pack_update(3, 4, True, False, 5, b"block")
        == bytes.fromhex(
            "c2 02 01 00 00000000 0300000000000000 0400000000000000 0500000000000000".replace(" ", "")
        )
        + b"block"
    )
    assert pack_write(6, SERIAL, 2, True, b"block") == (
        bytes.fromhex("c102020100000000 0600000000000000".replace(" ", "")) + SERIAL + b"block"
    )


def test_the_compiled_envelope_is_that_of_the_file(tmp_path):
    """``make proto`` compiles it."""
    protoc = pytest.importorskip("grpc_tools.protoc")
    source, out = Path(codec.__file__).with_name("envelope.proto"), tmp_path / "envelope.binpb"
    assert protoc.main(["", f"-I{source.parent}", f"--descriptor_set_out={out}", source.name]) == 0
    compiled = FileDescriptorSet.FromString(source.with_suffix(".binpb").read_bytes())
    assert compiled == FileDescriptorSet.FromString(out.read_bytes())


def test_the_manual_has_the_numbers_of_codes_and_kinds():
    page = (ROOT / "docs" / "evidence" / "protocol-zmq.md").read_text()
    numbers = " ".join(page[page.index("Numbers of codes:") : page.index("## Data")].split())
    for member in (*codec.ResultCode, *codec.ChangeKind, *codec.Stamp):
        assert re.search(rf"\b{member.name} {member.value}[,.]", numbers), member


@given(st.lists(st.binary(max_size=300), max_size=4))
def test_random_bytes_are_refused_or_make_sense(frames):
    try:
        frame = decode(frames)
    except ProtocolError:
        return
    assert frame.kind


@given(st.data())
def test_damaged_envelopes_are_refused_or_make_sense(data):
    body = {"request": 5, "hash": SERIAL, "type": "Type", "id": "id", "owner": "o", "size": 24}
    good = bytearray(encode("open", 1, body))
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
        frame = decode([bytes(good)])
    except ProtocolError:
        return
    assert frame.block is None or frame.kind


@pytest.mark.parametrize(
    ("frames", "text"),
    [
        ([], "one or two frames, not 0"),
        ([b"", b"", b""], "one or two frames, not 3"),
        ([b"x" * (codec.MAX_ENVELOPE + 1)], "at most 65536"),
        ([b"GET / HTTP/1.1\r\n\r\n"], "not an envelope"),
        ([b""], "version 0"),
        ([Envelope(version=1, beat={}).SerializeToString()], "version 1"),
        ([Envelope(version=VERSION).SerializeToString()], "without a body"),
        ([encode("beat", 1, {}), b"block"], "beat with a block"),
        ([pack_write(1, SERIAL, 0, False, b""), b"block"], "a data frame with another one behind it"),
        ([pack_write(1, SERIAL, 0, False, b"")[:-1]], "write of 31 bytes, its header has 32"),
        ([b"\xc1\x09" + bytes(30)], "version 9"),
        ([pack_credit(1, 2) + b"x"], "credit of 17 bytes, not 16"),
        ([b"\xc4\x02" + b"\xff" * 62], "a name is longer than 256"),
        ([b"\xc4\x02" + bytes(10) + b"\1\0\0\0" + bytes(48)], "send of 64 bytes, its names need 65"),
        ([b"\xc4\x02" + bytes(10) + b"\1\0\0\0" + bytes(48) + b"\xff"], "a name is not UTF-8"),
        ([encode("open", 1, {"hash": b"short"})], "open.hash has 5 bytes, not 16"),
        ([encode("hello", 0, {"session": SERIAL, "name": "n" * 257})], "hello.name is longer than 256"),
    ],
)
def test_what_is_refused(frames, text):
    with pytest.raises(ProtocolError, match=text):
        decode(frames)


def test_a_text_without_utf8_form_is_not_sent():
    with pytest.raises(ProtocolError, match="open cannot be sent"):
        encode("open", 1, {"owner": "\ud800"})


@pytest.mark.parametrize("thread", ["\ud800", "x" * 257])
def test_a_message_of_a_thread_without_a_bearable_name_is_not_sent(thread):
    with pytest.raises(ProtocolError, match="cannot be sent"):
        pack_send(1, SendBody(1, SERIAL, SERIAL, "Type", 1, thread, 0), b"")
