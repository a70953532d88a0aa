"""The server and its other clients survive invalid clients, which are logged once."""

from __future__ import annotations

import os
import random
import socket
from contextlib import ExitStack, closing, suppress
from urllib.parse import urlsplit

import pytest
import zmq

from cxbridge.blackboard.zmq.wire.frames import (
    MAX_FRAME_BYTES,
    Beat,
    Close,
    Gone,
    Hello,
    Open,
    Reply,
    ResultCode,
    Send,
    Sync,
    Welcome,
    Write,
    decode_server_frame,
    encode,
)
from tests.blackboard.samples import SampleInterface
from tests.blackboard.zmq.support import LONG, bench, eventually

SESSION = b"0123456789abcdef"
WRITE = encode(Write(SESSION, True, False, b"", number=1))


@pytest.fixture(params=["ipc", "tcp"])
def served(request, tmp_path):
    with bench(request.param, tmp_path, max_sessions=8) as served:
        yield served


def serves(served) -> bool:
    """Return whether the server serves a new client."""
    with served.client() as client, client.open_for_reading(SampleInterface, "a") as reader:
        return bool(reader.valid)


class HostilePeer:
    """A peer with the sockets of a client that sends arbitrary frames."""

    def __init__(self, served, session: bytes = SESSION) -> None:
        self.session = session
        context: zmq.Context[zmq.Socket[bytes]] = zmq.Context.instance()
        self.events, self.commands = context.socket(zmq.DEALER), context.socket(zmq.DEALER)
        for route, client_socket in ((b"e", self.events), (b"c", self.commands)):
            client_socket.linger = 0
            client_socket.routing_id = route + session
            client_socket.connect(served.url)

    def hello(self, **fields):
        self.events.send(encode(Hello(self.session, **fields)))
        return self.receive()

    def receive(self):
        while True:
            assert self.events.poll(int(LONG * 1000)), "no reply"
            frame = decode_server_frame(self.events.recv())
            if not isinstance(frame, Beat):
                return frame

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.events.close()
        self.commands.close()


def test_server_survives_random_bytes_of_raw_sockets(served):
    rng = random.Random(1)
    address = urlsplit(served.url)
    samples = [b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", b"\xff" * 64, b"\xff" + b"\xff" * 8 + b"\x7f", b""]
    samples += [rng.randbytes(rng.randrange(1, 200)) for _ in range(30)]
    # a valid greeting, then a frame of 4 GiB
    samples.append(b"\xff" + bytes(8) + b"\x7f\x01\x05" + b"\x00\x02" + b"\xff" * 8 + b"x" * 100)
    with ExitStack() as stack:
        for sample in samples:
            if address.scheme == "tcp":
                peer = socket.create_connection((address.hostname, address.port))
            else:
                peer = socket.socket(socket.AF_UNIX)
                peer.connect(address.path)
            stack.enter_context(closing(peer))
            with suppress(OSError):  # the server may have closed the connection
                peer.sendall(sample)
        assert serves(served)


def test_server_survives_invalid_frames_of_zeromq_peer(served):
    lines = served.collect_lines()
    rng = random.Random(2)
    with HostilePeer(served) as peer:
        for _ in range(300):
            peer.events.send_multipart([rng.randbytes(rng.randrange(64)) for _ in range(rng.randrange(1, 5))])
            peer.commands.send(rng.randbytes(20))
        assert peer.receive().code == ResultCode.PROTOCOL
        # libzmq closes this connection, perhaps before the reply
        peer.events.send(bytes(MAX_FRAME_BYTES + 1))
        assert serves(served)
    assert len([line for line in lines if "dropped a client" in line.text]) < 15


@pytest.mark.parametrize(
    ("frames", "code"),
    [
        ([encode(Sync(number=2, request=1))], ResultCode.FRAME_LOST),
        ([encode(Welcome(SESSION, 0, 0, number=1))], ResultCode.PROTOCOL),
        ([encode(Hello(SESSION, number=1))], ResultCode.PROTOCOL),
        ([encode(Sync(number=1, request=1)), b"block"], ResultCode.PROTOCOL),
        ([WRITE[:-1]], ResultCode.PROTOCOL),
        ([WRITE, b"c" + SESSION, b"x"], ResultCode.PROTOCOL),
        ([encode(Reply(number=1, request=1))], ResultCode.PROTOCOL),
    ],
)
def test_session_with_invalid_frames_is_ended(served, frames, code):
    with HostilePeer(served) as peer:
        assert isinstance(peer.hello(), Welcome)
        peer.commands.send_multipart(frames)
        frame = peer.receive()
        assert isinstance(frame, Gone)
        assert frame.code == code
        eventually(lambda: served.server.session_count == 0)


def test_client_of_another_version_gets_protocol_error(served):
    with HostilePeer(served) as peer:
        peer.events.send(encode(Hello(SESSION)).replace(b"\x08\x03", b"\x08\x09", 1))
        frame = peer.receive()
        assert frame.code == ResultCode.PROTOCOL
        assert "version 9" in frame.text


@pytest.mark.parametrize(
    ("request_frame", "code"),
    [
        (Close(SESSION), ResultCode.INVALID_INSTANCE),
        (Open("X", "a", SESSION, 0), ResultCode.UNKNOWN_TYPE),
        (Open("", "a", SESSION, 0), ResultCode.INVALID_NAME),
        (Open("SampleInterface", "\0", SESSION, 0), ResultCode.INVALID_NAME),
        (Open("SampleInterface", "a", SESSION, 2**32 - 1), ResultCode.VERSION_MISMATCH),
        (Send(SESSION, SESSION, "X", 1, "t", 0, b""), ResultCode.INVALID_INSTANCE),
    ],
)
def test_invalid_requests_are_refused(served, request_frame, code):
    with HostilePeer(served) as peer:
        peer.hello()
        request_frame.number, request_frame.request = 1, 5
        peer.commands.send(encode(request_frame))
        frame = peer.receive()
        assert isinstance(frame, Reply)
        assert (frame.request, frame.code) == (5, code)


def test_extra_frames_of_write_do_not_reach_other_clients(served):
    victim = served.client()
    writer = victim.open_for_writing(SampleInterface, "a")
    other = served.client()
    reader = other.open_for_reading(SampleInterface, "a")
    with HostilePeer(served) as peer:
        peer.hello()
        peer.commands.send_multipart([WRITE, b"x"])
        assert peer.receive().code == ResultCode.PROTOCOL
    writer.count = 3
    writer.write()
    served.settle()
    assert (reader.read(), reader.count) == (True, 3)


def test_sessions_above_limit_are_refused(served):
    with ExitStack() as stack:
        replies = [stack.enter_context(HostilePeer(served, os.urandom(16))).hello() for _ in range(10)]
    assert [type(reply) for reply in replies] == [Welcome] * 8 + [Gone] * 2
    assert replies[-1].code == ResultCode.TOO_MANY


def test_silent_session_is_ended(served):
    with HostilePeer(served) as peer:
        assert peer.hello().heartbeat_ms == 1000
        eventually(lambda: served.server.session_count == 0)
        assert peer.receive().code == ResultCode.SILENT


def test_write_to_instance_of_another_client_is_ignored(served):
    owner = served.client()
    reader = served.client().open_for_reading(SampleInterface, "a")
    writer = owner.open_for_writing(SampleInterface, "a")
    writer.count = 1
    writer.write()
    served.settle()
    with HostilePeer(served) as peer:
        peer.hello()
        block = bytes(SampleInterface.SCHEMA.datasize)
        for number, instance in enumerate((writer.serial, reader.serial), start=1):
            peer.commands.send(encode(Write(instance.bytes, True, True, block, number=number)))
        peer.commands.send(encode(Sync(number=3, request=1)))
        assert isinstance(peer.receive(), Reply)
    served.settle()
    assert reader.read()
    assert reader.count == 1
