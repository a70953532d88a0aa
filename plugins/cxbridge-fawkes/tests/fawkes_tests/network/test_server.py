"""The server with correct, faulty, slow and vanished clients."""

from __future__ import annotations

import socket
import struct
import threading
from uuid import UUID

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cxbridge.blackboard import Listener
from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.events import LogLine
from cxbridge_fawkes.network.allowed_peers import AllowedPeers
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.server import FawkesServer
from cxbridge_fawkes.network.session import NetworkHandler
from fawkes_tests.network.raw import TIMEOUT, RawClient
from tests.blackboard.samples import SAMPLE_SCHEMA, SampleInterface
from tests.blackboard.zmq.support import eventually
from tests.support import many

SIZE = SAMPLE_SCHEMA.datasize
READ = bb.Open("SampleInterface", "a", SAMPLE_SCHEMA.hash, writing=False)
WRITE = bb.Open("SampleInterface", "a", SAMPLE_SCHEMA.hash, writing=True)


def open_instance(client: RawClient, question: bb.Open) -> bb.OpenSuccess:
    client.send(question.to_frame())
    while True:
        answer = client.message()
        if not isinstance(answer, bb.InterfaceEvent | bb.InstanceEvent):
            assert isinstance(answer, bb.OpenSuccess)
            return answer


def is_serving(port: int) -> bool:
    with RawClient(port) as client:
        return isinstance(client.ask(bb.ListMatching("x", "x")), bb.InterfaceList)


# -- refusals


@pytest.mark.parametrize(
    ("question", "error", "complaint"),
    [
        (bb.Open("NoInterface", "a", bytes(16), writing=False), 1, "interface class not found"),
        (bb.Open("../../etc/passwd", "a", bytes(16), writing=False), 1, "interface class not found"),
        (
            bb.Open("SampleInterface", "new", bytes(16), writing=True),
            2,
            "hash mismatch",
        ),  # Fawkes creates the interface
        (WRITE, 3, "writer already exists"),
        (bb.Open("SampleInterface", "", SAMPLE_SCHEMA.hash, writing=False), 0, "ID may not be empty"),
    ],
)
def test_server_refuses_invalid_open(served, question, error, complaint):
    served.board.open_for_writing(SampleInterface, "a")
    client = served.raw()
    assert client.ask(question) == bb.OpenFailure(error)
    served.wait_warning(complaint)
    assert len(served.board.list_all()) == 1


def test_malformed_open_is_answered(served):
    client = served.raw()
    client.send(FawkesFrame(ComponentId.BLACKBOARD, bb.BoardKind.OPEN_FOR_READING, b"short"))
    assert client.message() == bb.OpenFailure(bb.OpenError.UNKNOWN)
    served.wait_warning("OPEN has 5 bytes, not 128")


@pytest.mark.parametrize(
    ("make", "complaint"),
    [
        (lambda serial: bb.DataMessage(serial, bytes(SIZE - 1), changed=True), "Data size mismatch"),
        (lambda serial: bb.DataMessage(UUID(int=1), bytes(SIZE), changed=True), "not found"),
        (lambda serial: bb.DataMessage(serial, bytes(SIZE), changed=True), "which it reads"),
        (lambda serial: bb.WireMessage(serial, serial, "NoMessage", 1, 0, bytes(16)), "NoMessage"),
        (lambda serial: bb.WireMessage(serial, serial, "AddMessage", 1, 0, bytes(7)), "size mismatch"),
        (lambda serial: bb.Close(UUID(int=1)), "has not been opened"),
        (lambda serial: FawkesFrame(2, 7), "Unknown message of type 7"),
        (lambda serial: FawkesFrame(77, 1, b"x"), "component 77, which does not exist"),
        (lambda serial: FawkesFrame(4, 1), "component 4, which does not exist"),
        (lambda serial: FawkesFrame(2, 9, b"xx"), "at least 20"),
    ],
)
def test_invalid_frames_are_ignored_and_logged_once(served, make, complaint):
    client = served.raw()
    serial = open_instance(client, READ).serial
    if "mismatch" in complaint and "Data" in complaint:
        client.send(bb.Close(serial).to_frame())
        serial = open_instance(client, WRITE).serial
    message = make(serial)
    frame = message if isinstance(message, FawkesFrame) else message.to_frame()
    client.send(*[frame] * 5)
    answer = client.ask(bb.ListMatching("x", "x"))
    while isinstance(answer, bb.InterfaceEvent):
        answer = client.message()
    assert answer == bb.InterfaceList(())
    served.wait_warning(complaint)
    assert len(served.warnings()) == 1


def test_client_cannot_use_instance_of_second_client(served):
    first, second = served.raw(), served.raw()
    serial = open_instance(first, WRITE).serial
    second.send(bb.DataMessage(serial, b"\x01" * SIZE, changed=True).to_frame(), bb.Close(serial).to_frame())
    assert isinstance(second.ask(bb.ListAll()), bb.InterfaceList | bb.InterfaceEvent)
    served.wait_warning("not found")
    served.wait_warning("has not been opened")
    assert served.board.list_all()[0].has_writer


def test_message_without_writer_is_logged_once(served):
    client = served.raw()
    serial = open_instance(client, READ).serial
    client.send(bb.WireMessage(serial, serial, "ResetMessage", 1, 0, bytes(16)).to_frame())
    served.wait_warning("no writing instance exists")
    assert isinstance(client.ask(bb.ListAll()), bb.InterfaceList)
    assert len(served.warnings()) == 1


def test_message_keeps_id_of_client(served):
    writer = served.board.open_for_writing(SampleInterface, "a")
    client = served.raw()
    serial = open_instance(client, READ).serial
    for message_id in (7, 8, 65536 + 3):
        client.send(bb.WireMessage(serial, serial, "ResetMessage", message_id, 0, bytes(16)).to_frame())
    assert isinstance(client.ask(bb.ListAll()), bb.InterfaceList)
    assert [message.id for message in writer.msgq_iter()] == [7, 8, 3]


def test_early_message_to_writer_follows_open_success(served):
    """A message sent on the event of the new writer must not stay in a queue without a client."""
    reader = served.board.open_for_reading(SampleInterface, "a")

    class SendsToNewWriter(Listener):
        def writer_added(self, interface, serial):
            interface.msgq_enqueue(SampleInterface.AddMessage(summand=7))

    served.board.register_listener(SendsToNewWriter(), reader)
    client = served.raw()
    serial = open_instance(client, WRITE).serial
    message = client.message()
    assert isinstance(message, bb.WireMessage)
    assert (message.serial, message.source, message.id) == (serial, reader.serial, 1)
    reader.msgq_enqueue(SampleInterface.ResetMessage())
    following = client.message()
    assert isinstance(following, bb.WireMessage)
    assert (following.type, following.id) == ("ResetMessage", 2)


# -- bytes that are not frames


@pytest.mark.parametrize("size", [4294967295, 20_000], ids=["too long", "longer than each open interface"])
def test_oversized_frame_ends_connection(served, size):
    client = served.raw()
    client.send(struct.pack(">HHI", 2, 10, size))
    assert client.closed_by_server()
    served.wait_warning(f"announces {size} bytes, but only")
    assert is_serving(served.server.port)


@settings(
    max_examples=many(60, 25), deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(noise=st.binary(min_size=1, max_size=300))
def test_random_bytes_do_not_stop_server(served, noise):
    with RawClient(served.server.port) as client:
        client.send(noise)
    assert is_serving(served.server.port)


# -- slow and dead clients


def test_client_with_full_queue_is_dropped(served, monkeypatch):
    monkeypatch.setattr("cxbridge_fawkes.network.session.MAX_QUEUED_BYTES", 100_000)
    client = served.raw()
    client.send(*[bb.ListAll().to_frame()] * 300_000)
    assert client.closed_by_server()
    served.wait_warning("it reads too slowly")
    assert is_serving(served.server.port)


def test_client_that_does_not_read_is_dropped(site, monkeypatch):
    monkeypatch.setattr("cxbridge_fawkes.network.server.STALL_S", 0.2)
    site.start()
    client = site.raw()
    open_instance(client, READ)
    writer = site.board.open_for_writing(SampleInterface, "a")
    for count in range(30_000):
        writer.count = count
        writer.write()
    site.wait_warning("it has not accepted data for 0.2 s")
    assert is_serving(site.server.port)


def test_server_closes_instances_of_vanished_client(served):
    client = served.raw()
    open_instance(client, READ)
    open_instance(client, WRITE)
    client.sock.setsockopt(
        socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0)
    )  # a reset instead of a close
    client.close()
    eventually(lambda: sum("client disconnected" in line.text for line in served.lines) == 2)
    assert is_serving(served.server.port)
    assert list(served.board.list_all()) == []


def test_server_refuses_clients_beyond_limit(site, monkeypatch):
    monkeypatch.setattr("cxbridge_fawkes.network.server.MAX_CLIENTS", 1)
    site.start()
    first = site.raw()
    assert isinstance(first.ask(bb.ListAll()), bb.InterfaceList)
    assert site.raw().closed_by_server()
    site.wait_warning("1 clients are connected")


# -- echo, stopping


def test_writer_gets_own_writes(served):
    client = served.raw()
    serial = open_instance(client, WRITE).serial
    client.send(bb.DataMessage(serial, b"\x01" * SIZE, changed=True).to_frame(), bb.ListAll().to_frame())
    assert [client.take().kind for _ in range(3)] == [9, 10, 1]


def test_stopped_server_closes_instances_of_clients(served):
    client = served.raw()
    open_instance(client, WRITE)
    served.server.stop()
    served.server.stop()
    assert client.closed_by_server()
    assert list(served.board.list_all()) == []


def test_two_servers_cannot_share_port(served):
    with pytest.raises(BlackBoardError, match=r"cannot listen on 127\.0\.0\.1:"):
        FawkesServer(served.board, port=served.server.port)


# -- allowed peers


def test_host_beyond_loopback_needs_allowed_peers(site):
    with pytest.raises(BlackBoardError, match=r"at 0\.0\.0\.0 could be reached") as caught:
        FawkesServer(site.board, "0.0.0.0", 0)
    assert "192.168.0.0/24" in str(caught.value)
    site.start()
    site.server.stop()
    server = FawkesServer(site.board, "0.0.0.0", 0, allow=["192.168.0.0/24"])
    with server:
        assert is_serving(server.port)


def test_allowed_peers_admit_networks_and_addresses():
    peers = AllowedPeers(["192.168.0.0/24", "10.0.0.7", "fd00::/8"])
    assert all(
        map(peers.admits, ["192.168.0.9", "10.0.0.7", "127.0.0.1", "::1", "fd00::1", "::ffff:10.0.0.7"])
    )
    assert not any(map(peers.admits, ["192.168.1.9", "10.0.0.8", "::2", "no address"]))
    with pytest.raises(BlackBoardError, match="'robot' is not an address"):
        AllowedPeers(["robot"])


def test_forbidden_peer_is_disconnected(served, monkeypatch):
    monkeypatch.setattr(served.server._allowed_peers, "admits", lambda host: False)
    assert served.raw().closed_by_server()
    served.wait_warning("not among the allowed peers")


def test_internal_error_is_logged_and_connection_stays(served, monkeypatch):
    def fails(*args: object) -> None:
        raise ZeroDivisionError("ours")

    monkeypatch.setattr(served.board, "list", fails)
    client = served.raw()
    client.send(bb.ListAll().to_frame())
    served.wait_warning("failed to serve client 1")
    assert isinstance(open_instance(client, READ), bb.OpenSuccess)
    assert all(isinstance(line, LogLine) for line in served.lines)


class LateAnswer(NetworkHandler):
    """A component that answers its first message after the client's disconnection."""

    COMPONENT = ComponentId.NETWORK_LOGGER

    def __init__(self):
        self.kinds: list[int] = []
        self.received, self.client_gone, self.over = threading.Event(), threading.Event(), threading.Event()

    def handle(self, session, frame):
        self.kinds.append(frame.kind)
        if frame.kind == 1:
            self.received.set()
            assert self.client_gone.wait(TIMEOUT)
            session.send(
                FawkesFrame(ComponentId.NETWORK_LOGGER, 9).to_bytes()
            )  # fails, because the client has reset the connection

    def disconnected(self, _session):
        self.over.set()


def test_last_message_of_client_with_unread_data_is_delivered(site):
    """A close with unread data resets the connection: the next send fails before the message is read."""
    component = LateAnswer()
    server = site.start(components=[component])
    client = site.raw()
    client.send(FawkesFrame(ComponentId.BLACKBOARD, 0xFFFF), FawkesFrame(ComponentId.NETWORK_LOGGER, 1))
    assert component.received.wait(TIMEOUT)
    (session,) = server._sessions.values()
    session.sock.send(b"unread")
    assert client.sock.recv(1, socket.MSG_PEEK)
    client.send(FawkesFrame(ComponentId.NETWORK_LOGGER, 2))
    client.close()
    component.client_gone.set()
    assert component.over.wait(TIMEOUT)
    assert component.kinds == [1, 2]
