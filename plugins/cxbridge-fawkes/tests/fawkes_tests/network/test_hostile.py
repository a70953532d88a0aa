"""Peers that are many, that stand still, that vanish without a word."""

from __future__ import annotations

import resource
import socket
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from queue import SimpleQueue
from typing import Any

import pytest

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.errors import WriterActiveError
from cxbridge.clock import RealClock
from cxbridge.events import EventBus, LogLine
from cxbridge.interfaces import default_registry
from cxbridge.interfaces.known_hashes import hash_for_wire
from cxbridge_fawkes.network.client import FawkesBlackBoard
from cxbridge_fawkes.network.errors import ConnectionLostError
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.outbox import CONFLATE_FROM
from cxbridge_fawkes.network.server import FawkesServer
from fawkes_tests.network.programs import TIMEOUT, Child
from fawkes_tests.network.raw import RawClient
from tests.blackboard.zmq.support import eventually
from tests.hosts.namespaces import two_hosts

HASH = hash_for_wire(default_registry().get("TestInterface").SCHEMA)
CONNECTIONS = 1000
MIB = 1024 * 1024


@pytest.fixture
def server() -> Iterator[Child]:
    with Child("serve", "127.0.0.1", 20) as child:
        yield child


def connect(port: int, bus: EventBus | None = None, **options: Any) -> FawkesBlackBoard:
    options = {"timeout": TIMEOUT} | options
    return FawkesBlackBoard(f"fawkes://127.0.0.1:{port}", default_registry(), RealClock(), bus, **options)


# -- a thousand connections


@pytest.fixture
def many_files() -> Iterator[None]:
    """Let this process and its children have ``count`` sockets."""
    needed = 2 * CONNECTIONS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < needed:
        pytest.skip(f"{needed} open files are needed, {hard} are allowed")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, needed), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def resident(pid: int) -> int:
    """Return the bytes of memory that a process has."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def open_files(pid: int) -> int:
    return len(list(Path(f"/proc/{pid}/fd").iterdir()))


def test_a_thousand_connections_cost_little_and_leave_nothing(many_files, server):
    pid = server.process.pid
    with connect(server.port) as board:
        good: Any = board.open_for_reading("TestInterface", "served")
        files, before, memory = open_files(pid), server.ask("list"), resident(pid)
        with ExitStack() as stack:
            crowd = [stack.enter_context(RawClient(server.port)) for _ in range(CONNECTIONS)]
            for number, one in enumerate(crowd):
                if number % 3 == 0:  # reads; the rest says nothing, or half of a frame
                    one.send(bb.Open("TestInterface", f"{number % 30}", HASH, writing=False).to_bytes())
                elif number % 3 == 1:
                    one.send(b"\0\x02\0")
            eventually(lambda: server.ask("clients") == CONNECTIONS + 1)
            opened = (CONNECTIONS + 2) // 3
            eventually(lambda: sum(readers for _, readers in server.ask("list").values()) >= opened)
            for number in range(1, 101):
                assert server.ask(f"write {number}") == number
            board.flush()
            good.read()
            assert good.test_int == 100
            assert resident(pid) - memory < 100 * MIB
        eventually(lambda: server.ask("clients") == 1)
        assert server.ask("list") == before
        assert open_files(pid) == files


# -- processes that stand still


@pytest.fixture
def home(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[LocalBlackBoard, FawkesServer]]:
    """A board whose server waits for ever for clients that stand still."""
    monkeypatch.setattr("cxbridge_fawkes.network.server.STALL_S", 3600.0)
    monkeypatch.setattr("cxbridge_fawkes.network.sockets.GONE_TIMEOUT_S", 3600.0)
    board = LocalBlackBoard(default_registry(), RealClock())
    with FawkesServer(board, port=0) as server:
        yield board, server


def test_a_stopped_reader_slows_nobody_takes_no_memory_and_gets_the_newest(home):
    board, server = home
    writer: Any = board.open_for_writing("TestInterface", "served")
    with Child("client", "127.0.0.1", server.port) as stopped, connect(server.port) as other:
        (session,) = (one for one in server._sessions.values() if one.number == 1)
        # the system would take more and more, also of the frames that have waited here for long
        session.sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 64 * 1024)
        reader: Any = other.open_for_reading("TestInterface", "served")
        stopped.stop()
        most = 0
        for number in range(1, 40_001):
            writer.test_int = number
            writer.write()
            most = max(most, session._outbox.queued_bytes)
            if number % 10_000 == 0:
                other.flush()
                reader.read()
                assert reader.test_int == number
        assert CONFLATE_FROM <= most < CONFLATE_FROM + MIB
        stopped.go_on()
        assert stopped.ask("read") == 40_000


def test_a_stopped_writer_keeps_its_place_and_goes_on(home):
    _, server = home
    with Child("client", "127.0.0.1", server.port) as stopped, connect(server.port) as other:
        stopped.stop()
        reader: Any = other.open_for_reading("TestInterface", "written")
        with pytest.raises(WriterActiveError):
            other.open_for_writing("TestInterface", "written")
        for _ in range(1000):
            reader.msgq_enqueue(reader.create_message("SetTestIntMessage"))
        other.flush()
        assert len(other.list_all()) == 3
        stopped.go_on()
        assert stopped.ask("write 7") == 7
        other.flush()
        reader.read()
        assert reader.test_int == 7


def test_a_stopped_server_is_gone_until_it_goes_on(server):
    """TCP does not notice: the kernel acknowledges for the process, and accepts connections to it."""
    bus, lines, changes = EventBus(RealClock()), list[str](), SimpleQueue[bool]()
    bus.subscribe(lambda event: lines.append(str(getattr(event, "text", ""))), LogLine)
    with connect(server.port, bus, timeout=1.0, silence=0.2) as board:
        board.add_connection_callback(changes.put)
        reader: Any = board.open_for_reading("TestInterface", "served")
        writer: Any = board.open_for_writing("TestInterface", "mine")
        server.stop()
        assert changes.get(timeout=TIMEOUT) is False
        with pytest.raises(ConnectionLostError):
            writer.write()
        assert not reader.has_writer
        links = [board._reconnector._connection]

        def tried_thrice() -> bool:
            if links[-1] is not board._reconnector._connection:
                links.append(board._reconnector._connection)
            return len(links) > 3

        eventually(tried_thrice)
        assert not board.connected
        server.go_on()
        assert changes.get(timeout=TIMEOUT) is True
        assert server.ask("write 5") == 5
        eventually(lambda: reader.read() and reader.test_int == 5)
    told = [line.partition(f":{server.port}")[2] for line in lines if "connection" in line]
    assert told[:2] == [": no reply within 1 s", " is back"]  # more, if it stood still again by itself


# -- machines that vanish


def test_what_a_vanished_machine_had_is_released():
    """No FIN comes: the cable is out. One connection is silent, to the other data are under way."""
    with ExitStack() as stack:
        robot, laptop = stack.enter_context(two_hosts())
        server = stack.enter_context(Child("serve", robot.address, 2, wrap=robot.command))
        gone = stack.enter_context(Child("client", robot.address, server.port, wrap=laptop.command))
        assert gone.ask("write 3") == 3
        assert gone.ask("acquire") == 1
        eventually(lambda: server.ask("controller"))
        stack.enter_context(Child("silent", robot.address, server.port, wrap=laptop.command))
        eventually(lambda: server.ask("clients") == 2)
        laptop.do("ip", "link", "set", "cable", "down")
        for number in range(10):
            server.ask(f"write {number}")
        eventually(lambda: server.ask("clients") == 0, TIMEOUT)
        theirs = {"TestInterface::written", "TestInterface::silent"}
        eventually(lambda: not theirs & server.ask("list").keys())
        eventually(lambda: not server.ask("controller"))
