"""Connections over loopback, also with clients that send garbage, flood the server or never read."""

from __future__ import annotations

import socket
import threading
import time
from contextlib import suppress

import pytest

from cxbridge.errors import ProtobufError
from cxbridge_protobuf import inbox, stream
from cxbridge_protobuf import network as network_module
from cxbridge_protobuf.crypto import CIPHER_NUMBERS
from cxbridge_protobuf.frames import Frame, add_header, encode_frame
from cxbridge_protobuf.inbox import ConnectionChange, LogWarning, Origin, ReceivedMessage
from cxbridge_protobuf.types import make_frame
from protobuf_tests.conftest import WAIT
from tests.support import free_port

ORDER = Frame(3000, 2, b"\x08\x05")
"""An Order with id 5."""


def served(nets, *address):
    """A server, its port."""
    net, port = nets(*address), free_port()
    net.enable_server(port)
    return net, port


def stranger(port):
    """A client that connects to a server by hand."""
    return socket.create_connection(("127.0.0.1", port), timeout=WAIT)


def joined(nets):
    """A server and a client, connected, and their ids for it."""
    server, port = served(nets)
    client = nets()
    client_id = client.connect("127.0.0.1", port)
    there = client.presence()
    assert (there.origin, there.link_id, there.connected) == (Origin.CLIENT, client_id, True)
    here = server.presence()
    assert (here.origin, here.connected, here.host) == (Origin.SERVER, True, "127.0.0.1")
    return server, here.link_id, client, client_id


def test_large_messages_come_whole_and_in_order(nets, types):
    server, _, client, there = joined(nets)
    for number in range(20):
        order = types.create("test_msgs.Order")
        order.id, order.text = number, "x" * 100_000
        client.send(there, make_frame(order))
    assert [event.message.id for event in server.wait(20, ReceivedMessage)] == list(range(20))


@pytest.mark.parametrize(
    "end", [lambda server, _: server.disable_server(), lambda server, here: server.disconnect(here)]
)
def test_a_server_that_goes_or_sends_a_client_away_is_told_to_the_client(nets, end):
    server, here, client, there = joined(nets)
    end(server, here)
    gone = client.presence()
    assert (gone.link_id, gone.connected) == (there, False)
    with pytest.raises(ProtobufError, match="not connected"):
        client.send(there, ORDER)


def test_a_client_that_goes_is_told_to_the_server_but_not_to_itself(nets):
    server, here, client, there = joined(nets)
    client.disconnect(there)
    gone = server.presence()
    assert (gone.link_id, gone.connected) == (here, False)
    client.send(there, ORDER)  # unknown by now
    assert client.drain() == []


def test_a_connection_that_cannot_be_made(nets):
    client = nets()
    client_id = client.connect("127.0.0.1", free_port())
    gone = client.presence()
    assert (gone.origin, gone.link_id, gone.connected) == (Origin.CLIENT, client_id, False)
    with pytest.raises(ProtobufError, match="not connected"):
        client.send(client_id, ORDER)


def test_a_port_that_is_taken(nets):
    net, port = nets(), free_port()
    with socket.create_server(("127.0.0.1", port)), pytest.raises(ProtobufError, match=f"port {port}"):
        net.enable_server(port)
    udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    with udp:
        udp.bind(("127.0.0.1", 0))
        taken = udp.getsockname()[1]
        with pytest.raises(ProtobufError, match=f"port {taken}"):
            net.create_peer("127.0.0.1", free_port(socket.SOCK_DGRAM), taken, "", "")


def test_a_server_listens_on_loopback_unless_told_otherwise(nets):
    everywhere, port = served(nets, "*")
    with stranger(port):
        assert everywhere.presence().host == "127.0.0.1"
    net, _ = served(nets)
    assert net._server is not None
    assert [sock.getsockname()[0] for sock in net._server.sockets] == ["127.0.0.1"]


# -- invalid messages and floods


@pytest.mark.parametrize(
    "rubbish", [b"GET / HTTP/1.1\r\n\r\n", bytes.fromhex("02000000ffffffff"), b"\0" * 64]
)
def test_garbage_and_a_frame_of_4_gib_close_the_connection_only(nets, rubbish):
    server, port = served(nets)
    with stranger(port) as bad, stranger(port) as good:
        server.wait(2, ConnectionChange)
        bad.sendall(rubbish)
        assert bad.recv(10) == b""
        assert not server.presence().connected
        assert "closed:" in server.warned()
        good.sendall(encode_frame(ORDER))
        assert server.message().message.id == 5


def test_a_client_that_never_reads_is_sent_away(nets, types, monkeypatch):
    monkeypatch.setattr(stream, "MAX_OUTBOUND_BYTES", 100_000)
    server, port = served(nets)
    order = types.create("test_msgs.Order")
    order.text = "x" * 500_000
    with stranger(port):
        here = server.presence().link_id
        with suppress(ProtobufError):  # the server may drop the client before the last message
            for _ in range(100):
                server.send(here, make_frame(order))
        assert "reads too slowly" in server.warned()
        assert not server.presence().connected


def test_a_flood_is_read_no_further_than_rules_can_take(nets, monkeypatch):
    monkeypatch.setattr(inbox, "MAX_MESSAGES", 100)
    server, port = served(nets)
    count = 50_000
    with stranger(port) as flood:
        sender = threading.Thread(target=flood.sendall, args=(encode_frame(ORDER) * count,))
        sender.start()
        time.sleep(0.3)  # long enough for all messages
        got, most = 0, 0
        while got < count:
            # messages that arrived before the wait are in `seen`
            events = server.wait(1, ReceivedMessage)
            waiting = sum(isinstance(event, ReceivedMessage) for event in server.seen)
            server.seen = [event for event in server.seen if not isinstance(event, ReceivedMessage)]
            got, most = got + len(events) + waiting, max(most, len(events) + waiting)
        sender.join(WAIT)
    # asyncio may have read a buffer beyond the limit: 256 KiB of frames of 14 bytes
    assert most < 100 + 262_144 // 14 + 1


def test_too_many_clients(nets, monkeypatch):
    monkeypatch.setattr(network_module, "MAX_CLIENTS", 1)
    server, port = served(nets)
    with stranger(port):
        assert server.presence().connected
        with stranger(port) as second:
            assert second.recv(1) == b""
        assert "too many" in server.warned()


# -- peers


def two_peers(nets, secret="", cipher=""):
    """Two peers that send to each other."""
    ports = [free_port(socket.SOCK_DGRAM) for _ in range(2)]
    one, two = nets(), nets()
    first = one.create_peer("127.0.0.1", ports[0], ports[1], secret, cipher)
    second = two.create_peer("127.0.0.1", ports[1], ports[0], secret, cipher)
    return one, first, two, second


@pytest.mark.parametrize("cipher", ["", *CIPHER_NUMBERS])
def test_peers_exchange_messages(nets, cipher):
    one, first, two, second = two_peers(nets, "randomkey", cipher)
    one.broadcast(first, ORDER)
    got = two.message()
    assert (got.origin, got.link_id, got.host, got.message.id) == (Origin.PEER, second, "127.0.0.1", 5)
    two.send(second, ORDER)
    assert one.message().link_id == first


@pytest.mark.parametrize(
    ("ours", "theirs", "problem"),
    [
        (("k", ""), ("k", "aes-128-cbc"), "encryption is disabled"),
        (("k", "aes-128-cbc"), ("k", ""), "encryption is enabled"),
        (("k", "aes-128-cbc"), ("other", "aes-128-cbc"), "same on both sides"),
    ],
)
def test_peers_with_different_keys_do_not_understand_each_other(nets, ours, theirs, problem):
    one, first, two, second = two_peers(nets)
    two.setup_crypto(second, *ours)
    one.setup_crypto(first, *theirs)
    one.broadcast(first, ORDER)
    assert problem in two.warned()
    two.setup_crypto(second, *theirs)
    one.broadcast(first, ORDER)
    assert two.message().message.id == 5


def test_a_peer_does_not_hear_itself(nets):
    net, port = nets(), free_port(socket.SOCK_DGRAM)
    peer = net.create_peer("127.0.0.1", port, port, "", "")
    net.broadcast(peer, ORDER)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.sendto(encode_frame(Frame(3000, 2, b"\x08\x06")), ("127.0.0.1", port))
    assert net.message().message.id == 6
    time.sleep(0.1)  # the broadcast leaves in the thread of the network
    assert net.drain() == []


def test_a_port_is_free_as_soon_as_its_user_is_gone(nets):
    net, tcp = served(nets)
    udp = free_port(socket.SOCK_DGRAM)
    for _ in range(20):
        peer = net.create_peer("127.0.0.1", udp, udp, "", "")
        net.destroy_peer(peer)
        net.disable_server()
        net.enable_server(tcp)
    assert net.drain() == []


def test_a_long_message_is_not_sent(nets):
    one, first, _, _ = two_peers(nets)
    with pytest.raises(ProtobufError, match="too big"):
        one.broadcast(first, Frame(1, 1, b"x" * 1025))
    server, _, client, there = joined(nets)
    with pytest.raises(ProtobufError, match="too big"):
        client.send(there, Frame(1, 1, bytes(stream.MAX_MESSAGE_BYTES + 1)))
    assert server.drain() == []


def test_garbage_for_a_peer_is_told_once(nets):
    net, port = nets(), free_port(socket.SOCK_DGRAM)
    net.create_peer("127.0.0.1", free_port(socket.SOCK_DGRAM), port, "", "")
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        for _ in range(20):
            for rubbish in (
                b"",
                b"x",
                b"\x03" + b"\0" * 30,
                add_header(0, b"abc"),
                encode_frame(Frame(8, 8, b"")),
            ):
                other.sendto(rubbish, ("127.0.0.1", port))
        other.sendto(encode_frame(ORDER), ("127.0.0.1", port))
    assert net.message().message.id == 5
    texts = [event.text for event in net.seen if isinstance(event, LogWarning)]
    assert len(texts) == 2  # of frames, and of messages
    assert any("8:8 not registered" in text for text in texts)


def test_a_destroyed_peer_and_unknown_ids_are_silent(nets):
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


def test_a_host_that_is_not_found_is_an_error(nets, monkeypatch):
    def fail(*_arguments, **_options):
        raise socket.gaierror("no such host")

    monkeypatch.setattr(socket, "getaddrinfo", fail)
    with pytest.raises(ProtobufError, match=r"cannot resolve the host robot\.invalid"):
        nets().create_peer("robot.invalid", 4444, 4445, "", "")


def test_the_last_message_of_a_client_that_leaves_data_unread_is_delivered(nets):
    """Closing with unread data resets the connection: the next send fails with the message still unread."""
    server, port = served(nets)
    for _number in range(60):
        client = stranger(port)
        here = server.presence().link_id
        server.send(here, ORDER)
        assert client.recv(1, socket.MSG_PEEK)  # it has arrived, and stays unread
        client.sendall(encode_frame(ORDER))
        client.close()
        for _again in range(5):
            server.send(here, ORDER)  # fails as soon as the reset has come
        assert server.message().message.id == 5
        assert not server.presence().connected
