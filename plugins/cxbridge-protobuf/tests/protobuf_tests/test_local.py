"""Connections between environments of one process: as over sockets, but in the order of sending."""

from __future__ import annotations

import pytest

from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.inbox import ConnectionChange, LogWarning, Origin, ReceivedMessage
from cxbridge_protobuf.local import LOCAL_HOST, LocalNetwork
from cxbridge_protobuf.types import MessageTypes, make_frame
from protobuf_tests.conftest import PROTOS

CIPHER = "aes-128-cbc"


@pytest.fixture(scope="module")
def types():
    made = MessageTypes(lambda _text: None)
    made.add_folders([PROTOS])
    return made


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


def test_a_peer_hears_what_is_sent_to_its_port(members, frame):
    one, two, three = members
    sender = one.create_peer("10.0.0.255", 4444, 4445, "", "")
    receiver = two.create_peer("10.0.0.255", 4445, 4444, "", "")
    three.create_peer("10.0.0.255", 4445, 5555, "", "")
    one.broadcast(sender, frame)
    (event,) = two.drain()
    assert (event.origin, event.link_id, event.host, event.port) == (Origin.PEER, receiver, LOCAL_HOST, 4445)
    assert (event.arrival_us, event.message.text) == (7, "hello")
    assert one.drain() == three.drain() == []
    two.send(receiver, frame)
    assert texts(one) == ["hello"]
    two.destroy_peer(receiver)
    one.broadcast(sender, frame)
    assert two.drain() == []


def test_who_has_another_key_hears_nothing(members, frame):
    one, two, _ = members
    sender = one.create_peer("x", 4444, 4445, "", "")
    two.create_peer("x", 4445, 4444, "secret", CIPHER)
    one.broadcast(sender, frame)
    one.broadcast(sender, frame)
    (warned,) = two.drain()  # once, not for each message
    assert isinstance(warned, LogWarning)
    assert "port 4444 have a different key" in warned.text
    one.setup_crypto(sender, "secret", CIPHER.upper())
    one.broadcast(sender, frame)
    assert texts(two) == ["hello"]
    one.setup_crypto(sender, "", "")
    one.broadcast(sender, frame)
    assert texts(two) == []


def test_a_client_and_a_server(members, frame):
    server, client, other = members
    server.enable_server(4444)
    link = client.connect("anywhere", 4444)
    (there,) = server.drain()
    assert (there.origin, there.connected, there.host) == (Origin.SERVER, True, LOCAL_HOST)
    assert client.drain() == [
        ConnectionChange(Origin.CLIENT, link, connected=True, host="anywhere", port=4444)
    ]
    client.send(link, frame)
    server.send(there.link_id, frame)
    assert texts(server) == texts(client) == ["hello"]
    client.disconnect(link)
    assert server.drain() == [ConnectionChange(Origin.SERVER, there.link_id, connected=False)]
    server.send(there.link_id, frame)
    assert client.drain() == []
    with pytest.raises(ProtobufError, match="address already in use"):
        other.enable_server(4444)
    client.connect("anywhere", 4444)
    client.drain()
    server.close()
    assert [event.connected for event in client.drain()] == [False]
    other.enable_server(4444)


def test_nobody_listens(members):
    link = members[0].connect("robot", 4444)
    assert members[0].drain() == [
        LogWarning("Cannot connect to robot:4444: connection refused"),
        ConnectionChange(Origin.CLIENT, link, connected=False),
    ]
    assert members[0].connect("robot", 0) == members[0].create_peer("x", 0, 1, "", "") == 0


def test_a_message_that_nobody_knows(members):
    one, two, _ = members
    sender = one.create_peer("x", 1, 2, "", "")
    two.create_peer("x", 2, 1, "", "")
    one.broadcast(sender, Frame(9, 9, b""))
    (warned,) = two.drain()
    assert "Message type 9:9 not registered" in warned.text
    two.enable_server(5)
    one.send(one.connect("x", 5), Frame(9, 9, b""))
    assert [event.problem for event in two.drain() if isinstance(event, ReceivedMessage)] == [
        "Message type 9:9 not registered"
    ]
