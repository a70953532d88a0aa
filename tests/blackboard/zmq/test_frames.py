"""Frames: valid frames pass unchanged, invalid bytes raise ProtocolError."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

import pytest
from google.protobuf.descriptor_pb2 import FileDescriptorSet
from hypothesis import given
from hypothesis import strategies as st

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire import frames
from cxbridge.blackboard.zmq.wire.frames import (
    Beat,
    ClientFrame,
    Credit,
    Frame,
    Hello,
    Open,
    ResultCode,
    ServerFrame,
    Update,
    Write,
    decode_client_frame,
    decode_server_frame,
    encode,
)
from fuzz.seeds import ZMQ_FRAMES, zmq_seeds
from fuzz.targets import zmq_frame
from tests.support import ROOT

SERIAL = bytes(range(16))
KINDS = {*get_args(ClientFrame), *get_args(ServerFrame)}
PAGE = (ROOT / "docs" / "evidence" / "protocol-zmq.md").read_text()


@pytest.mark.parametrize("frame", ZMQ_FRAMES, ids=lambda frame: type(frame).__name__)
def test_only_peer_decodes_encoded_frame(frame: Frame):
    for decode, kinds in ((decode_client_frame, ClientFrame), (decode_server_frame, ServerFrame)):
        if isinstance(frame, kinds):
            assert decode(encode(frame)) == frame
        else:
            with pytest.raises(ProtocolError, match="not a frame of version 3"):
                decode(encode(frame))


def test_samples_have_each_kind_of_frame():
    assert {type(frame) for frame in ZMQ_FRAMES} == KINDS


def test_bytes_of_frames_do_not_change():
    assert encode(Update(3, 4, True, False, 5, b"block")).hex(" ") == (
        "98 18 03 04 c3 c2 05 c4 05 62 6c 6f 63 6b 00"
    )
    assert encode(Write(SERIAL, None, True, b"block", number=6)) == (
        bytes.fromhex("96 08 c4 10") + SERIAL + bytes.fromhex("c0 c3 c4 05 62 6c 6f 63 6b 06")
    )


def test_compiled_envelope_matches_proto_file(tmp_path):
    """``make proto`` compiles it."""
    protoc = pytest.importorskip("grpc_tools.protoc")
    source, out = Path(frames.__file__).with_name("envelope.proto"), tmp_path / "envelope.binpb"
    assert protoc.main(["", f"-I{source.parent}", f"--descriptor_set_out={out}", source.name]) == 0
    compiled = FileDescriptorSet.FromString(source.with_suffix(".binpb").read_bytes())
    assert compiled == FileDescriptorSet.FromString(out.read_bytes())


def test_manual_lists_frames_and_codes():
    for kind in KINDS:
        row = re.search(rf"^\| {kind.__name__} \| (\w+) \| ([\w, ]*) \|", PAGE, re.MULTILINE)
        assert row, kind
        assert row[1] == str(kind.__struct_config__.tag or "envelope")
        assert row[2] == ", ".join(kind.__struct_fields__)
    numbers = " ".join(PAGE[PAGE.index("Numbers of codes:") : PAGE.index("## Data")].split())
    for code in ResultCode:
        assert re.search(rf"\b{code.name} {code.value}[,.]", numbers), code


@given(st.binary(max_size=300))
def test_random_bytes_are_frame_or_refused(data):
    zmq_frame(data)


@given(st.sampled_from(tuple(zmq_seeds())), st.data())
def test_damaged_frames_are_frame_or_refused(seed, data):
    damaged = bytearray(seed)
    for _ in range(data.draw(st.integers(1, 4))):
        position = data.draw(st.integers(0, len(damaged) - 1))
        match data.draw(st.integers(0, 2)):
            case 0:
                damaged[position] = data.draw(st.integers(0, 255))
            case 1:
                del damaged[position + 1 :]
            case _:
                damaged[position:position] = data.draw(st.binary(min_size=1, max_size=9))
    zmq_frame(bytes(damaged))


@pytest.mark.parametrize(
    ("data", "text"),
    [
        (b"", "version 0 of"),
        (encode(Hello(SERIAL)).replace(b"\x08\x03", b"\x08\x02", 1), "version 2 of .* instead of version 3"),
        (encode(Beat())[:2], "an envelope without a frame"),
        (b"GET / HTTP/1.1\r\n\r\n", "not a frame of version 3"),
        (encode(Credit(1)) + b"x", "trailing"),
        (encode(Credit(2**32)), "<= 4294967295"),
        (encode(Write(b"short", True, True, b"")), "length >= 16"),
        (encode(Open("T", "i", SERIAL, 0, "o" * 257)), "length <= 256"),
        (encode(Hello(SERIAL, name="n" * 257)), "length <= 256"),
        (encode(Open("T", "i", SERIAL, 0)).replace(b"\x01i", b"\x01\xff"), "not a frame of version 3"),
    ],
)
def test_invalid_bytes_are_refused(data, text):
    with pytest.raises(ProtocolError, match=text):
        decode_client_frame(data)


def test_text_without_utf8_form_is_not_sent():
    with pytest.raises(ProtocolError, match="Open cannot be sent"):
        encode(Open("T", "i", SERIAL, 0, "\ud800"))
