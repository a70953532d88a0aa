"""Peers that do not read, stop, end without Bye, announce gigabytes, or connect by the thousand."""

from __future__ import annotations

import os
import resource
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack, suppress
from urllib.parse import urlsplit

import pytest
import zmq

from cxbridge.blackboard.zmq.wire.frames import MAX_FRAME_BYTES, Hello, List, Open, encode
from tests.blackboard.samples import SampleInterface
from tests.blackboard.zmq.support import LONG, bench, eventually
from tests.blackboard.zmq.test_hostile import serves

SCHEMA = SampleInterface.SCHEMA
HEARTBEAT = 0.2


def open_sample(number: int) -> bytes:
    return encode(Open(SCHEMA.name, "a", SCHEMA.hash, SCHEMA.datasize, number=number, request=number))


def memory() -> int:
    """Return the resident memory of this process in bytes."""
    with open("/proc/self/statm") as file:  # noqa: PTH123 - no file of ours
        return int(file.read().split()[1]) * resource.getpagesize()


@pytest.fixture
def served(tmp_path):
    with bench("tcp", tmp_path, heartbeat=HEARTBEAT) as served:
        yield served


# -- peers that do not read


@pytest.mark.parametrize("transport", ["ipc", "tcp"])
def test_client_that_does_not_read_is_dropped(transport, tmp_path):
    with bench(
        transport, tmp_path, heartbeat=3600.0
    ) as served:  # a long heartbeat, because the client is silent, too
        lines = served.collect_lines()
        context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        events, commands = (context.socket(zmq.DEALER) for _ in range(2))
        session, commands.sndtimeo = os.urandom(16), int(LONG * 1000)
        for route, peer in ((b"e", events), (b"c", commands)):
            peer.linger, peer.rcvhwm, peer.rcvbuf, peer.routing_id = 0, 1, 4096, route + session
            peer.connect(served.url)
        try:
            events.send(encode(Hello(session, name="deaf")))
            eventually(lambda: served.server.session_count == 1)
            commands.send(open_sample(1))
            writer = served.board.open_for_writing(SampleInterface, "a")
            reader = served.client().open_for_reading(SampleInterface, "a")
            for number in range(10):  # for long replies
                served.board.open_for_reading(SampleInterface, f"number {number}", owner="x" * 200)
            before = memory()
            for count in range(1, 3001):
                writer.count = count
                writer.write()
            eventually(lambda: reader.read() and reader.count == 3000)
            for number in range(2, 30_000):  # replies are not conflated
                if served.server.session_count == 1:
                    break
                commands.send(encode(List("*", "*", number=number, request=number)))
            eventually(lambda: served.server.session_count == 1)
            assert memory() - before < 50e6
        finally:
            context.destroy(linger=0)
        assert serves(served)
        assert [line.text for line in lines if "deaf" in line.text] == ["dropped client deaf: TOO_SLOW"]


# -- peers that stop or end

CLIENT = """
import sys, time
from cxbridge.blackboard.zmq import ZmqBlackBoard
from cxbridge.clock import RealClock
from tests.blackboard.samples import SampleInterface, SampleRegistry
board = ZmqBlackBoard(sys.argv[1], SampleRegistry(), RealClock())
writer = board.open_for_writing(SampleInterface, "a", owner="victim")
reader = board.open_for_reading(SampleInterface, "b")
print("open", flush=True)
sys.stdin.readline()
try:
    while True:
        writer.count += 1
        writer.write()
        time.sleep(0.01)
except Exception as error:
    print(type(error).__name__, flush=True)
sys.stdin.readline()
"""


@pytest.mark.parametrize("last", [signal.SIGCONT, signal.SIGKILL])
def test_instances_of_stopped_process_stay_closed_after_continue(served, last):
    command = [sys.executable, "-c", CLIENT, served.url]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True) as victim:
        assert victim.stdin is not None
        assert victim.stdout is not None
        try:
            assert victim.stdout.readline() == "open\n"
            reader = served.client().open_for_reading(SampleInterface, "a")
            assert reader.writer == "victim"
            victim.send_signal(signal.SIGSTOP)
            eventually(lambda: not served.board.list("*", "b"))
            eventually(lambda: not reader.has_writer)
            writer = served.client().open_for_writing(SampleInterface, "a", owner="heir")
            victim.send_signal(last)
            if last is signal.SIGCONT:
                victim.stdin.write("\n")
                victim.stdin.flush()
                assert victim.stdout.readline() == "InvalidInstanceError\n"
            writer.count = 70_000
            writer.write()
            served.settle()
            assert reader.read()
            assert (reader.count, reader.writer) == (70_000, "heir")
        finally:
            victim.kill()


# -- peers that announce large frames

GREETING = b"\xff" + bytes(8) + b"\x7f\x03\x00" + b"NULL".ljust(20, b"\0") + bytes(32)
_READY = b"\x05READY\x0bSocket-Type\x00\x00\x00\x06DEALER"
READY = b"\x04" + bytes([len(_READY)]) + _READY
SIZES = [MAX_FRAME_BYTES + 1, (1 << 32) - 1, 1 << 32, (1 << 63) - 1, (1 << 64) - 1]


@pytest.mark.parametrize("size", SIZES)
def test_announced_frame_of_gigabytes_needs_no_memory(served, size):
    address = urlsplit(served.url)
    before = memory()
    with socket.create_connection((address.hostname, address.port)) as peer:
        peer.settimeout(LONG)
        peer.sendall(GREETING + READY)
        received = b""
        while b"READY" not in received:
            data = peer.recv(4096)
            assert data, "the server has closed the connection"
            received += data
        peer.sendall(b"\x02" + size.to_bytes(8, "big") + b"x" * 1000)
        with suppress(ConnectionError):
            while peer.recv(4096):
                pass  # until the server closes the connection
    assert memory() - before < 50e6
    assert serves(served)


# -- many peers


def test_thousand_silent_clients_are_dropped(tmp_path):
    if resource.getrlimit(resource.RLIMIT_NOFILE)[0] < 5000:
        pytest.skip("too few file descriptors")
    with bench("ipc", tmp_path, heartbeat=HEARTBEAT) as served, ExitStack() as stack:
        lines = served.collect_lines()
        before = memory()
        context: zmq.Context[zmq.Socket[bytes]] = zmq.Context()
        context.max_sockets = 1100
        stack.callback(context.term)
        for number in range(1000):
            session = number.to_bytes(16, "big")
            client_socket = context.socket(zmq.DEALER)
            stack.callback(client_socket.close, linger=0)
            client_socket.routing_id = b"e" + session
            client_socket.connect(served.url)
            client_socket.send(encode(Hello(session, name=f"number {number}")))
        eventually(lambda: any("dropped client" in line.text for line in lines))
        assert serves(served)
        eventually(lambda: served.server.session_count <= len(served.clients), timeout=60)
        assert memory() - before < 300e6
        assert len([line for line in lines if "dropped client" in line.text]) <= 4
