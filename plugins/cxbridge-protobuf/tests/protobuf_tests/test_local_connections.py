"""Connections between environments of a process, in the order of sending."""

from __future__ import annotations

import pytest

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import ConnectionChange, LinkRole, LogWarning, ReceivedMessage
from cxbridge_protobuf.local_connections import LOCAL_HOST, LocalNetwork
from cxbridge_protobuf.types import MessageTypes, make_frame
from protobuf_tests.conftest import PROTOS

CIPHER = "aes-128-cbc"


@pytest.fixture(scope="module")
def types():
    message_types = MessageTypes(lambda _text: None)
    message_types.add_folders([PROTOS])
    return message_types


@pytest.fixture
def members(types):
    network = LocalNetwork()
    return [network.join(types, lambda: 7) for _ in range(3)]


@pytest.fixture
def frame(types):
    message = types.create("test_msgs.Order")
    message.text = "hello"
    return make_frame(message)


def texts(connections):
    events = connections.drain()
    return [event.message.text for event in events if isinstance(event, ReceivedMessage) and event.message]


def test_peer_receives_messages_to_its_port(members, frame):
    first, second, third = members
    sender = first.create_peer("10.0.0.255", 4444, 4445, "", "")
    receiver = second.create_peer("10.0.0.255", 4445, 4444, "", "")
    third.create_peer("10.0.0.255", 4445, 5555, "", "")
    first.broadcast(sender, frame)
    (event,) = second.drain()
    assert (event.role, event.link_id, event.host, event.port) == (LinkRole.PEER, receiver, LOCAL_HOST, 4445)
    assert (event.arrival_us, event.message.text) == (7, "hello")
    assert first.drain() == third.drain() == []
    second.send(receiver, frame)
    assert texts(first) == ["hello"]
    second.destroy_peer(receiver)
    first.broadcast(sender, frame)
    assert second.drain() == []


def test_peer_with_different_key_receives_nothing(members, frame):
    first, second, _ = members
    sender = first.create_peer("x", 4444, 4445, "", "")
    second.create_peer("x", 4445, 4444, "secret", CIPHER)
    first.broadcast(sender, frame)
    first.broadcast(sender, frame)
    (warning,) = second.drain()  # once, not for each message
    assert isinstance(warning, LogWarning)
    assert "port 4444 have a different key" in warning.text
    first.setup_crypto(sender, "secret", CIPHER.upper())
    first.broadcast(sender, frame)
    assert texts(second) == ["hello"]
    first.setup_crypto(sender, "", "")
    first.broadcast(sender, frame)
    assert texts(second) == []


def test_client_and_server_exchange_messages(members, frame):
    server, client, second_server = members
    server.enable_server(4444)
    link = client.connect("anywhere", 4444)
    (accepted,) = server.drain()
    assert (accepted.role, accepted.is_connected, accepted.host) == (LinkRole.SERVER, True, LOCAL_HOST)
    assert client.drain() == [
        ConnectionChange(LinkRole.CLIENT, link, is_connected=True, host="anywhere", port=4444)
    ]
    client.send(link, frame)
    server.send(accepted.link_id, frame)
    assert texts(server) == texts(client) == ["hello"]
    client.disconnect(link)
    assert server.drain() == [ConnectionChange(LinkRole.SERVER, accepted.link_id, is_connected=False)]
    server.send(accepted.link_id, frame)
    assert client.drain() == []
    with pytest.raises(ProtobufError, match="address already in use"):
        second_server.enable_server(4444)
    client.connect("anywhere", 4444)
    client.drain()
    server.close()
    assert [event.is_connected for event in client.drain()] == [False]
    second_server.enable_server(4444)


def test_connection_without_server_is_refused(members):
    link = members[0].connect("robot", 4444)
    assert members[0].drain() == [
        LogWarning("Cannot connect to robot:4444: connection refused"),
        ConnectionChange(LinkRole.CLIENT, link, is_connected=False),
    ]
    assert members[0].connect("robot", 0) == members[0].create_peer("x", 0, 1, "", "") == 0


def test_unregistered_message_is_warning_or_problem(members):
    first, second, _ = members
    sender = first.create_peer("x", 1, 2, "", "")
    second.create_peer("x", 2, 1, "", "")
    first.broadcast(sender, Frame(9, 9, b""))
    (warning,) = second.drain()
    assert "Message type 9:9 not registered" in warning.text
    second.enable_server(5)
    first.send(first.connect("x", 5), Frame(9, 9, b""))
    assert [event.problem for event in second.drain() if isinstance(event, ReceivedMessage)] == [
        "Message type 9:9 not registered"
    ]
