"""Peers that are numerous, stopped, or vanish without closing."""

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
    """Raise the limit of open files for this process and its children."""
    needed = 2 * CONNECTIONS
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard != resource.RLIM_INFINITY and hard < needed:
        pytest.skip(f"{needed} open files are needed, {hard} are allowed")
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, needed), hard))
    yield
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def resident(pid: int) -> int:
    """Return the resident memory of a process in bytes."""
    pages = int(Path(f"/proc/{pid}/statm").read_text().split()[1])
    return pages * resource.getpagesize()


def open_files(pid: int) -> int:
    return len(list(Path(f"/proc/{pid}/fd").iterdir()))


def test_thousand_connections_need_little_memory_and_are_released(many_files, server):
    pid = server.process.pid
    with connect(server.port) as board:
        reader: Any = board.open_for_reading("TestInterface", "served")
        files, before, memory = open_files(pid), server.ask("list"), resident(pid)
        with ExitStack() as stack:
            clients = [stack.enter_context(RawClient(server.port)) for _ in range(CONNECTIONS)]
            for number, client in enumerate(clients):
                if number % 3 == 0:  # a reader; the rest is silent or sends half of a frame
                    client.send(bb.Open("TestInterface", f"{number % 30}", HASH, writing=False).to_bytes())
                elif number % 3 == 1:
                    client.send(b"\0\x02\0")
            eventually(lambda: server.ask("clients") == CONNECTIONS + 1)
            opened = (CONNECTIONS + 2) // 3
            eventually(lambda: sum(readers for _, readers in server.ask("list").values()) >= opened)
            for number in range(1, 101):
                assert server.ask(f"write {number}") == number
            board.flush()
            reader.read()
            assert reader.test_int == 100
            assert resident(pid) - memory < 100 * MIB
        eventually(lambda: server.ask("clients") == 1)
        assert server.ask("list") == before
        assert open_files(pid) == files


# -- stopped processes


@pytest.fixture
def patient_server(monkeypatch: pytest.MonkeyPatch) -> Iterator[tuple[LocalBlackBoard, FawkesServer]]:
    """A board whose server waits for ever for stopped clients."""
    monkeypatch.setattr("cxbridge_fawkes.network.server.STALL_S", 3600.0)
    monkeypatch.setattr("cxbridge_fawkes.network.sockets.GONE_TIMEOUT_S", 3600.0)
    board = LocalBlackBoard(default_registry(), RealClock())
    with FawkesServer(board, port=0) as server:
        yield board, server


def test_stopped_reader_costs_nothing_and_gets_newest_data(patient_server):
    board, server = patient_server
    writer: Any = board.open_for_writing("TestInterface", "served")
    with Child("client", "127.0.0.1", server.port) as stopped, connect(server.port) as board:
        (session,) = (client for client in server._sessions.values() if client.number == 1)
        # a larger buffer of the system would also take frames that have waited for long
        session.sock.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 64 * 1024)
        reader: Any = board.open_for_reading("TestInterface", "served")
        stopped.stop()
        max_queued = 0
        for number in range(1, 40_001):
            writer.test_int = number
            writer.write()
            max_queued = max(max_queued, session._outbox.queued_bytes)
            if number % 10_000 == 0:
                board.flush()
                reader.read()
                assert reader.test_int == number
        assert CONFLATE_FROM <= max_queued < CONFLATE_FROM + MIB
        stopped.resume()
        assert stopped.ask("read") == 40_000


def test_stopped_writer_stays_writer_and_continues(patient_server):
    _, server = patient_server
    with Child("client", "127.0.0.1", server.port) as stopped, connect(server.port) as board:
        stopped.stop()
        reader: Any = board.open_for_reading("TestInterface", "written")
        with pytest.raises(WriterActiveError):
            board.open_for_writing("TestInterface", "written")
        for _ in range(1000):
            reader.msgq_enqueue(reader.create_message("SetTestIntMessage"))
        board.flush()
        assert len(board.list_all()) == 3
        stopped.resume()
        assert stopped.ask("write 7") == 7
        board.flush()
        reader.read()
        assert reader.test_int == 7


def test_stopped_server_is_disconnected_until_continued(server):
    """TCP does not notice the stop: the kernel acknowledges data and accepts connections for the process."""
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
        connections = [board._reconnector._connection]

        def tried_thrice() -> bool:
            if connections[-1] is not board._reconnector._connection:
                connections.append(board._reconnector._connection)
            return len(connections) > 3

        eventually(tried_thrice)
        assert not board.connected
        server.resume()
        assert changes.get(timeout=TIMEOUT) is True
        assert server.ask("write 5") == 5
        eventually(lambda: reader.read() and reader.test_int == 5)
    messages = [line.partition(f":{server.port}")[2] for line in lines if "connection" in line]
    assert messages[:2] == [": no reply within 1 s", " is back"]  # a loaded machine may add further pairs


# -- machines that vanish


def test_server_releases_interfaces_of_vanished_machine():
    """A disconnected cable sends no FIN. One connection is idle, one has data in transit."""
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
        uids = {"TestInterface::written", "TestInterface::silent"}
        eventually(lambda: not uids & server.ask("list").keys())
        eventually(lambda: not server.ask("controller"))
