"""Connections over loopback, including clients that send garbage, flood the server or never read."""

from __future__ import annotations

import socket
import threading
import time
from contextlib import suppress

import pytest

from cxbridge.errors import ProtobufError
from cxbridge_protobuf import inbox, stream
from cxbridge_protobuf import socket_connections as network_module
from cxbridge_protobuf.crypto import CIPHER_NUMBERS
from cxbridge_protobuf.frames import Frame, add_header, encode_frame
from cxbridge_protobuf.inbox import ConnectionChange, LinkRole, LogWarning, ReceivedMessage
from cxbridge_protobuf.types import make_frame
from protobuf_tests.conftest import WAIT
from tests.support import free_port

ORDER = Frame(3000, 2, b"\x08\x05")
"""An Order with id 5."""


def start_server(nets, *address):
    """Return a server and its port."""
    net, port = nets(*address), free_port()
    net.enable_server(port)
    return net, port


def connect_raw(port):
    """Return a bare socket that is connected to a server."""
    return socket.create_connection(("127.0.0.1", port), timeout=WAIT)


def connect_pair(nets):
    """Return a server and its client, each with its id of the connection."""
    server, port = start_server(nets)
    client = nets()
    client_id = client.connect("127.0.0.1", port)
    change = client.presence()
    assert (change.role, change.link_id, change.is_connected) == (LinkRole.CLIENT, client_id, True)
    accepted = server.presence()
    assert (accepted.role, accepted.is_connected, accepted.host) == (LinkRole.SERVER, True, "127.0.0.1")
    return server, accepted.link_id, client, client_id


def test_large_messages_arrive_complete_and_in_order(nets, types):
    server, _, client, client_link = connect_pair(nets)
    for number in range(20):
        order = types.create("test_msgs.Order")
        order.id, order.text = number, "x" * 100_000
        client.send(client_link, make_frame(order))
    assert [event.message.id for event in server.wait(20, ReceivedMessage)] == list(range(20))


@pytest.mark.parametrize(
    "end",
    [lambda server, _: server.disable_server(), lambda server, server_link: server.disconnect(server_link)],
)
def test_client_gets_disconnection_by_server(nets, end):
    server, server_link, client, client_link = connect_pair(nets)
    end(server, server_link)
    change = client.presence()
    assert (change.link_id, change.is_connected) == (client_link, False)
    with pytest.raises(ProtobufError, match="not connected"):
        client.send(client_link, ORDER)


def test_only_server_gets_disconnection_by_client(nets):
    server, server_link, client, client_link = connect_pair(nets)
    client.disconnect(client_link)
    change = server.presence()
    assert (change.link_id, change.is_connected) == (server_link, False)
    client.send(client_link, ORDER)  # the link no longer exists
    assert client.drain() == []


def test_connection_without_server_is_closed(nets):
    client = nets()
    client_id = client.connect("127.0.0.1", free_port())
    change = client.presence()
    assert (change.role, change.link_id, change.is_connected) == (LinkRole.CLIENT, client_id, False)
    with pytest.raises(ProtobufError, match="not connected"):
        client.send(client_id, ORDER)


def test_used_port_is_error(nets):
    net, port = nets(), free_port()
    with socket.create_server(("127.0.0.1", port)), pytest.raises(ProtobufError, match=f"port {port}"):
        net.enable_server(port)
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with udp:
        udp.bind(("127.0.0.1", 0))
        used_port = udp.getsockname()[1]
        with pytest.raises(ProtobufError, match=f"port {used_port}"):
            net.create_peer("127.0.0.1", free_port(socket.SOCK_DGRAM), used_port, "", "")


def test_server_listens_on_loopback_by_default(nets):
    public, port = start_server(nets, "*")
    with connect_raw(port):
        assert public.presence().host == "127.0.0.1"
    net, _ = start_server(nets)
    assert net._server is not None
    assert [sock.getsockname()[0] for sock in net._server.sockets] == ["127.0.0.1"]


# -- invalid messages and floods


@pytest.mark.parametrize(
    "garbage", [b"GET / HTTP/1.1\r\n\r\n", bytes.fromhex("02000000ffffffff"), b"\0" * 64]
)
def test_garbage_or_huge_frame_closes_only_its_connection(nets, garbage):
    server, port = start_server(nets)
    with connect_raw(port) as faulty, connect_raw(port) as valid:
        server.wait(2, ConnectionChange)
        faulty.sendall(garbage)
        assert faulty.recv(10) == b""
        assert not server.presence().is_connected
        assert "closed:" in server.warning()
        valid.sendall(encode_frame(ORDER))
        assert server.message().message.id == 5


def test_client_that_never_reads_is_disconnected(nets, types, monkeypatch):
    monkeypatch.setattr(stream, "MAX_OUTBOUND_BYTES", 100_000)
    server, port = start_server(nets)
    order = types.create("test_msgs.Order")
    order.text = "x" * 500_000
    with connect_raw(port):
        server_link = server.presence().link_id
        with suppress(ProtobufError):  # the server may drop the client before the last message
            for _ in range(100):
                server.send(server_link, make_frame(order))
        assert "reads too slowly" in server.warning()
        assert not server.presence().is_connected


def test_server_reads_flood_only_up_to_limit(nets, monkeypatch):
    monkeypatch.setattr(inbox, "MAX_MESSAGES", 100)
    server, port = start_server(nets)
    count = 50_000
    with connect_raw(port) as flood:
        sender = threading.Thread(target=flood.sendall, args=(encode_frame(ORDER) * count,))
        sender.start()
        time.sleep(0.3)  # long enough for all messages
        received, max_waiting = 0, 0
        while received < count:
            # messages that arrived before the wait are in `server.events`
            events = server.wait(1, ReceivedMessage)
            waiting = sum(isinstance(event, ReceivedMessage) for event in server.events)
            server.events = [event for event in server.events if not isinstance(event, ReceivedMessage)]
            received, max_waiting = received + len(events) + waiting, max(max_waiting, len(events) + waiting)
        sender.join(WAIT)
    # asyncio may have read a buffer beyond the limit: 256 KiB of frames of 14 bytes
    assert max_waiting < 100 + 262_144 // 14 + 1


def test_server_refuses_clients_beyond_limit(nets, monkeypatch):
    monkeypatch.setattr(network_module, "MAX_CLIENTS", 1)
    server, port = start_server(nets)
    with connect_raw(port):
        assert server.presence().is_connected
        with connect_raw(port) as second:
            assert second.recv(1) == b""
        assert "too many" in server.warning()


# -- peers


def open_peer_pair(nets, secret="", cipher=""):
    """Return two networks and their peers, which send to each other."""
    ports = [free_port(socket.SOCK_DGRAM) for _ in range(2)]
    net_a, net_b = nets(), nets()
    peer_a = net_a.create_peer("127.0.0.1", ports[0], ports[1], secret, cipher)
    peer_b = net_b.create_peer("127.0.0.1", ports[1], ports[0], secret, cipher)
    return net_a, peer_a, net_b, peer_b


@pytest.mark.parametrize("cipher", ["", *CIPHER_NUMBERS])
def test_peers_exchange_messages(nets, cipher):
    net_a, peer_a, net_b, peer_b = open_peer_pair(nets, "randomkey", cipher)
    net_a.broadcast(peer_a, ORDER)
    event = net_b.message()
    assert (event.role, event.link_id, event.host, event.message.id) == (
        LinkRole.PEER,
        peer_b,
        "127.0.0.1",
        5,
    )
    net_b.send(peer_b, ORDER)
    assert net_a.message().link_id == peer_a


@pytest.mark.parametrize(
    ("own_key", "remote_key", "problem"),
    [
        (("k", ""), ("k", "aes-128-cbc"), "encryption is disabled"),
        (("k", "aes-128-cbc"), ("k", ""), "encryption is enabled"),
        (("k", "aes-128-cbc"), ("different", "aes-128-cbc"), "same on both sides"),
    ],
)
def test_message_with_different_key_is_warning(nets, own_key, remote_key, problem):
    net_a, peer_a, net_b, peer_b = open_peer_pair(nets)
    net_b.setup_crypto(peer_b, *own_key)
    net_a.setup_crypto(peer_a, *remote_key)
    net_a.broadcast(peer_a, ORDER)
    assert problem in net_b.warning()
    net_b.setup_crypto(peer_b, *remote_key)
    net_a.broadcast(peer_a, ORDER)
    assert net_b.message().message.id == 5


def test_peer_does_not_receive_own_messages(nets):
    net, port = nets(), free_port(socket.SOCK_DGRAM)
    peer = net.create_peer("127.0.0.1", port, port, "", "")
    net.broadcast(peer, ORDER)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        sender.sendto(encode_frame(Frame(3000, 2, b"\x08\x06")), ("127.0.0.1", port))
    assert net.message().message.id == 6
    time.sleep(0.1)  # the broadcast leaves in the thread of the network
    assert net.drain() == []


def test_port_is_free_after_close(nets):
    net, tcp = start_server(nets)
    udp = free_port(socket.SOCK_DGRAM)
    for _ in range(20):
        peer = net.create_peer("127.0.0.1", udp, udp, "", "")
        net.destroy_peer(peer)
        net.disable_server()
        net.enable_server(tcp)
    assert net.drain() == []


def test_too_long_message_is_not_sent(nets):
    net_a, peer_a, _, _ = open_peer_pair(nets)
    with pytest.raises(ProtobufError, match="too big"):
        net_a.broadcast(peer_a, Frame(1, 1, b"x" * 1025))
    server, _, client, client_link = connect_pair(nets)
    with pytest.raises(ProtobufError, match="too big"):
        client.send(client_link, Frame(1, 1, bytes(stream.MAX_MESSAGE_BYTES + 1)))
    assert server.drain() == []


def test_garbage_for_peer_is_logged_once_per_kind(nets):
    net, port = nets(), free_port(socket.SOCK_DGRAM)
    net.create_peer("127.0.0.1", free_port(socket.SOCK_DGRAM), port, "", "")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for _ in range(20):
            for garbage in (
                b"",
                b"x",
                b"\x03" + b"\0" * 30,
                add_header(0, b"abc"),
                encode_frame(Frame(8, 8, b"")),
            ):
                sender.sendto(garbage, ("127.0.0.1", port))
        sender.sendto(encode_frame(ORDER), ("127.0.0.1", port))
    assert net.message().message.id == 5
    texts = [event.text for event in net.events if isinstance(event, LogWarning)]
    assert len(texts) == 2  # a warning about frames, a warning about messages
    assert any("8:8 not registered" in text for text in texts)


def test_destroyed_peer_and_unknown_ids_are_ignored(nets):
    net = nets()
    peer = net.create_peer("127.0.0.1", free_port(socket.SOCK_DGRAM), free_port(socket.SOCK_DGRAM), "", "")
    net.destroy_peer(peer)
    for link in (peer, 99):
        net.broadcast(link, ORDER)
        net.send(link, ORDER)
        net.disconnect(link)
        net.destroy_peer(link)
        net.setup_crypto(link, "k", "aes-128-cbc")
    assert net.drain() == []


def test_unknown_host_is_error(nets, monkeypatch):
    def fail(*_arguments, **_options):
        raise socket.gaierror("no such host")

    monkeypatch.setattr(socket, "getaddrinfo", fail)
    with pytest.raises(ProtobufError, match=r"cannot resolve the host robot\.invalid"):
        nets().create_peer("robot.invalid", 4444, 4445, "", "")


def test_last_message_of_client_with_unread_data_is_delivered(nets):
    """A close with unread data resets the connection: the next send fails before the message is read."""
    server, port = start_server(nets)
    for _number in range(60):
        client = connect_raw(port)
        server_link = server.presence().link_id
        server.send(server_link, ORDER)
        assert client.recv(1, socket.MSG_PEEK)  # the message has arrived and stays unread
        client.sendall(encode_frame(ORDER))
        client.close()
        for _ in range(5):
            server.send(server_link, ORDER)  # fails after the reset
        assert server.message().message.id == 5
        assert not server.presence().is_connected
