"""File descriptors are used up by those who merely connect: the daemon pauses, says it once, and goes on.

What attacks is this program with sockets of the operating system; none of our clients takes part.
"""

from __future__ import annotations

import os
import resource
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import ExitStack, closing, contextmanager
from dataclasses import dataclass
from pathlib import Path

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.kit.accepting import PatientListener, Shortage
from cxbridge.blackboard.zmq import ZmqBlackBoard, ZmqBlackBoardServer
from cxbridge.clock import RealClock
from cxbridge.events import EventBus, LogLine
from cxbridge.interfaces import InterfaceRegistry
from tests.support import ROOT, needs_plugin

LIMIT, IDLE = 64, 200
FEW, MORE_THAN_FEW = 34, 16
"""Descriptors for no more than the process itself, and connections that want more: they are let go again one
by one, some seven a second."""
WATCHED_S = 0.8
WAIT_S = 60
HTTP_REQUEST = b"GET /api/cxbridge/status HTTP/1.0\r\nHost: localhost\r\n\r\n"
ZMTP_GREETING = b"\xff\0\0\0\0\0\0\0\1\x7f"
PROGRAM = (
    "import resource, sys; limit = int(sys.argv[1]);"
    "resource.setrlimit(resource.RLIMIT_NOFILE, (limit, limit));"
    "from cxbridge.cli.main import main; main(['daemon', 'start', sys.argv[2]])"
)

if sys.platform != "linux":
    pytest.skip("needs /proc", allow_module_level=True)


def free_port() -> int:
    with closing(socket.socket()) as one:
        one.bind(("127.0.0.1", 0))
        return int(one.getsockname()[1])


@dataclass
class Attacked:
    process: subprocess.Popen[bytes]
    log: Path
    ports: dict[str, int]

    def cpu_s(self) -> float:
        fields = Path(f"/proc/{self.process.pid}/stat").read_text().rpartition(")")[2].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")

    def lines(self) -> list[str]:
        return self.log.read_text().splitlines()

    def answers(self, name: str) -> bool:
        """Whether somebody who behaves gets an answer."""
        try:
            with socket.create_connection(("127.0.0.1", self.ports[name]), 1) as peer:
                if name == "fawkes":
                    return bool(select_closed(peer))
                peer.sendall(HTTP_REQUEST if name == "http" else ZMTP_GREETING)
                return bool(peer.recv(20))
        except OSError:
            return False

    def until(self, name: str) -> None:
        deadline = time.monotonic() + WAIT_S
        while not self.answers(name):
            assert time.monotonic() < deadline, (name, self.lines()[-5:])
            threading.Event().wait(0.2)


def select_closed(peer: socket.socket) -> bool:
    """Whether a connection stays: who is refused by Fawkes' port is closed at once."""
    peer.settimeout(0.3)
    try:
        return peer.recv(1) != b""
    except TimeoutError:
        return True


@contextmanager
def attacked(tmp_path: Path, limit: int = LIMIT) -> Iterator[Attacked]:
    ports = {name: free_port() for name in ("http", "fawkes", "zmq")}
    config = tmp_path / "daemon.yaml"
    config.write_text(
        f"cxbridge:\n  executive: false\n  skiller: none\n  web: {{port: {ports['http']}}}\n"
        f"  zmq: {{endpoints: ['tcp://127.0.0.1:{ports['zmq']}']}}\n  fawkes: {{port: {ports['fawkes']}}}\n"
    )
    log = tmp_path / "log"
    with log.open("wb") as file:
        process = subprocess.Popen(
            [sys.executable, "-c", PROGRAM, str(limit), str(config)],
            cwd=ROOT,
            stdout=file,
            stderr=file,
        )
    one = Attacked(process, log, ports)
    try:
        for name in ports:
            one.until(name)
        yield one
    finally:
        process.terminate()
        status = process.wait(WAIT_S)
    assert status == 0, one.lines()
    assert not [line for line in one.lines() if "Traceback" in line]


@contextmanager
def idle(port: int, count: int = IDLE) -> Iterator[list[socket.socket]]:
    """So many connections that say nothing."""
    with ExitStack() as stack:
        peers = []
        for _ in range(count):
            peer = stack.enter_context(closing(socket.socket()))
            peer.setblocking(False)
            peer.connect_ex(("127.0.0.1", port))
            peers.append(peer)
        yield peers


@needs_plugin("web")
@pytest.mark.parametrize("name", ["http", "fawkes", "zmq"])
def test_idle_connections_do_not_keep_it_busy_and_it_serves_on(tmp_path: Path, name: str) -> None:
    """It wrote 18,000 tracebacks in 5 s (http), and used a core in libzmq (zmq)."""
    with attacked(tmp_path) as daemon:
        before = len(daemon.lines())
        with idle(daemon.ports[name]):
            start, used = time.monotonic(), daemon.cpu_s()
            threading.Event().wait(WATCHED_S)
            share = (daemon.cpu_s() - used) / (time.monotonic() - start)
            assert share < 0.5  # of a core: it was all of one
            assert len(daemon.lines()) - before <= 4, daemon.lines()
            assert daemon.process.poll() is None
            for other in daemon.ports.keys() - {name}:
                daemon.until(other)  # the others have their share
        for each in daemon.ports:
            daemon.until(each)


@needs_plugin("web")
def test_when_no_descriptor_is_left_it_says_so_once_and_accepts_again(tmp_path: Path) -> None:
    """Shares do not help when the process itself has opened the rest: the listener pauses."""
    with attacked(tmp_path, limit=FEW) as daemon, ExitStack() as stack:
        for name in ("http", "fawkes"):  # libzmq has no pause: docs/security.md
            stack.enter_context(idle(daemon.ports[name], MORE_THAN_FEW))
        assert wait_until(lambda: any("cannot accept" in line for line in daemon.lines()))
        start, used = time.monotonic(), daemon.cpu_s()
        threading.Event().wait(WATCHED_S)
        assert (daemon.cpu_s() - used) / (time.monotonic() - start) < 0.5
        told = [line for line in daemon.lines() if "cannot accept" in line]
        assert len(told) == len({line.partition(":")[0] for line in told})  # once a listener
        stack.close()
        for name in daemon.ports:
            daemon.until(name)


def test_a_shortage_is_told_once_a_minute(monkeypatch: pytest.MonkeyPatch) -> None:
    lines: list[str] = []
    now = [1000.0]
    monkeypatch.setattr("cxbridge.blackboard.kit.accepting.time.monotonic", lambda: now[0])
    shortage = Shortage(lines.append, "clients")
    for _ in range(500):
        shortage.report("Too many open files")
    now[0] += 59
    shortage.report("Too many open files")
    assert lines == ["cannot accept clients: Too many open files; they wait until there is room"]
    now[0] += 2
    shortage.report("Too many open files")
    assert lines[1:] == [f"{lines[0]} (500 more times since it was told)"]


def test_a_listener_pauses_after_a_shortage(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = []

    def refuse(_self: object) -> None:
        tried.append(1)
        raise OSError(24, "Too many open files")

    monkeypatch.setattr(socket.socket, "accept", refuse)
    with closing(PatientListener.of(socket.create_server(("127.0.0.1", 0)))) as listener:
        with pytest.raises(OSError, match="Too many open files"):
            listener.accept()
        for _ in range(100):
            with pytest.raises(BlockingIOError):
                listener.accept()
    assert tried == [1]


class Exhausted:
    """Takes all descriptors that are left to this process, but as many as are named."""

    def __init__(self, spare: int = 0) -> None:
        self._spare = spare
        self._taken: list[int] = []

    def __enter__(self) -> None:
        self._limits = resource.getrlimit(resource.RLIMIT_NOFILE)
        highest = max(int(each.name) for each in Path("/proc/self/fd").iterdir()) + 8
        resource.setrlimit(resource.RLIMIT_NOFILE, (highest, self._limits[1]))
        try:
            while True:
                self._taken.append(os.open(os.devnull, os.O_RDONLY))
        except OSError:
            for _ in range(self._spare):
                os.close(self._taken.pop())

    def __exit__(self, *_: object) -> None:
        for descriptor in self._taken:
            os.close(descriptor)
        resource.setrlimit(resource.RLIMIT_NOFILE, self._limits)


@pytest.mark.parametrize("spare", range(6))
def test_a_client_over_zmq_connects_again_when_there_are_descriptors(tmp_path: Path, spare: int) -> None:
    """EMFILE when a session began ended the client's thread: it never came back."""
    registry, clock = InterfaceRegistry(), RealClock()
    with closing_board(LocalBlackBoard(registry, clock)) as local:
        endpoint = f"tcp://127.0.0.1:{free_port()}"
        server = ZmqBlackBoardServer(local, [endpoint], heartbeat=0.1)
        server.start()
        try:
            with ZmqBlackBoard(endpoint, registry, clock, heartbeat=0.1) as client:
                assert wait_until(lambda: client.connected)
                server.stop()
                assert wait_until(lambda: not client.connected)
                with Exhausted(spare):
                    threading.Event().wait(0.6)  # it tries
                server = ZmqBlackBoardServer(local, [endpoint], heartbeat=0.1)
                server.start()
                assert wait_until(lambda: client.connected)
        finally:
            server.stop()


@contextmanager
def closing_board(board: LocalBlackBoard) -> Iterator[LocalBlackBoard]:
    yield board
    board.shutdown()


def wait_until(condition: object) -> bool:
    assert callable(condition)
    deadline = time.monotonic() + WAIT_S
    while not condition():
        if time.monotonic() > deadline:
            return False
        threading.Event().wait(0.02)
    return True


def test_those_who_are_in_stay_while_strangers_are_sent_away() -> None:
    bus = EventBus(RealClock())
    lines: list[str] = []
    bus.subscribe(lambda event: lines.append(getattr(event, "text", "")), LogLine)
    registry, clock = InterfaceRegistry(), RealClock()
    local = LocalBlackBoard(registry, clock, bus)
    with ZmqBlackBoardServer(local, ["tcp://127.0.0.1:*"], most_connections=6) as server:
        port = int(server.endpoints[0].rpartition(":")[2])
        lost: list[bool] = []
        with ZmqBlackBoard(server.endpoints[0], registry, clock) as client:
            assert wait_until(lambda: client.connected)
            client.on_connection(lost.append)
            with idle(port, 100) as peers:
                ended = lambda: sum(is_ended(peer) for peer in peers)  # noqa: E731
                assert wait_until(lambda: ended() >= 90)
                assert client.connected
                with client.open_for_writing("SkillerInterface", "S") as writer:
                    writer.write()
            assert lost == []
        assert [line for line in lines if "connections, the next are ended" in line]
        with ZmqBlackBoard(server.endpoints[0], registry, clock) as client:
            assert wait_until(lambda: client.connected)
    local.shutdown()


def is_ended(peer: socket.socket) -> bool:
    try:
        while data := peer.recv(100):
            del data
    except BlockingIOError:
        return False
    except OSError:
        return True
    return True
