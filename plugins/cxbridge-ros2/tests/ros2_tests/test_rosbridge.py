"""A rosbridge that is unreachable, closes the connection, or sends invalid messages."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Iterator
from functools import partial
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rosbags", reason="the extra ros2 is not installed")
pytest.importorskip("websockets", reason="the extra ros2 is not installed")

from websockets.sync.server import Server, ServerConnection, serve

from cxbridge.errors import ConfigError, Ros2Error
from cxbridge_ros2.actions import ActionClient, GoalStatus
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.settings import NodeSettings
from cxbridge_ros2.transports.rosbridge import RosbridgeNode, connection
from cxbridge_ros2.transports.rosbridge.connection import RosbridgeConnection
from ros2_tests.conftest import poll_until, wait_until
from ros2_tests.peer import PACKAGES

FIBONACCI = "example_interfaces/action/Fibonacci"


class ScriptedServer:
    """A server that records received messages, and sends messages of a test."""

    def __init__(self, port: int = 0) -> None:
        self.got: list[dict[str, Any]] = []
        self.sockets: list[ServerConnection] = []
        self._server: Server = serve(self._talk, "127.0.0.1", port)
        self.port = self._server.socket.getsockname()[1]
        self._thread = threading.Thread(target=self._server.serve_forever)
        self._thread.start()

    def _talk(self, socket: ServerConnection) -> None:
        self.sockets.append(socket)
        for text in socket:
            self.got.append(json.loads(text))

    def ops(self) -> list[str]:
        return [each["op"] for each in self.got]

    def send(self, text: str) -> None:
        self.sockets[-1].send(text)

    def close(self) -> None:
        for socket in self.sockets:
            socket.close()
        self._server.shutdown()
        self._thread.join()


@pytest.fixture
def server() -> Iterator[ScriptedServer]:
    instance = ScriptedServer()
    yield instance
    instance.close()


@pytest.fixture
def node(server: ScriptedServer) -> Iterator[RosbridgeNode]:
    with make_node(server.port) as instance:
        yield instance


def make_node(port: int) -> RosbridgeNode:
    return RosbridgeNode("test", Definitions([PACKAGES], environment={}), f"ws://127.0.0.1:{port}")


@pytest.mark.parametrize("url", ["http://robot", "robot:9090", "", "ws://127.0.0.1:1", "ws://[::bad"])
def test_unreachable_bridge_is_reported_with_hint(url: str):
    with pytest.raises(Ros2Error) as caught:
        RosbridgeNode("test", Definitions(environment={}), url)
    assert caught.value.hint


def test_http_server_is_refused_as_bridge():
    with HTTPServer(("127.0.0.1", 0), BaseHTTPRequestHandler) as server:
        thread = threading.Thread(target=server.handle_request)
        thread.start()
        with pytest.raises(Ros2Error, match="cannot connect to the rosbridge at ws://"):
            make_node(server.server_port)
        thread.join()


def test_node_restores_endpoints_after_reconnection(server: ScriptedServer, node: RosbridgeNode):
    node.subscribe("/a", "std_msgs/msg/String", lambda _: None)
    ended = node.subscribe("/b", "std_msgs/msg/String", lambda _: None)
    node.create_publisher("/c", "std_msgs/msg/String")
    node.serve("/d", "std_srvs/srv/Trigger", lambda _: {})
    ended()
    poll_until(node, lambda: "unsubscribe" in server.ops())
    server.got.clear()
    server.sockets[-1].close()
    poll_until(node, lambda: len(server.got) >= 3)
    assert server.ops() == ["subscribe", "advertise", "advertise_service"]
    assert server.got[0]["topic"] == "/a"


def test_lost_connection_ends_calls_and_goals(server: ScriptedServer, node: RosbridgeNode):
    reasons: list[str] = []
    node.create_client("/d", "std_srvs/srv/Trigger").call({}, lambda _: None, reasons.append)
    client = ActionClient(node, "/count", FIBONACCI)
    sent = client.send({"order": 3})
    poll_until(node, lambda: sent.is_accepted)
    server.sockets[-1].close()
    poll_until(node, lambda: sent.is_over and reasons)
    assert sent.status is GoalStatus.ABORTED
    assert reasons == [sent.reason] == ["the connection to the rosbridge was lost"]


@pytest.mark.parametrize(
    "text",
    [
        *("", "{", "[]", "3", "null", '{"op": 3}', '{"op": "unknown"}', "\0", '{"op": "publish"}'),
        *('{"op": "publish", "topic": "/a"}', '{"op": "publish", "topic": "/a", "msg": 3}'),
        *('{"op": "publish", "topic": ["/a"]}', '{"op": "publish", "topic": "/a", "msg": {"data": {}}}'),
        *('{"op": "service_response"}', '{"op": "call_service", "service": "/d"}'),
        *('{"op": "call_service", "service": {}}', '{"op": "action_feedback", "action": "/count"}'),
        *('{"op": "action_result", "action": "/count", "id": []}', '{"op": "action_result", "action": []}'),
        '{"op": "cxbridge: lost", "x": ' + "[" * 5000 + "]" * 5000 + "}",
    ],
)
def test_invalid_messages_of_bridge_are_ignored(server: ScriptedServer, node: RosbridgeNode, text: str):
    got: list[Any] = []
    node.subscribe("/a", "std_msgs/msg/String", got.append)
    node.serve("/d", "std_srvs/srv/SetBool", lambda _: {})
    client = ActionClient(node, "/count", FIBONACCI)
    sent = client.send({"order": 3})
    poll_until(node, lambda: sent.is_accepted)
    poll_until(node, lambda: "send_action_goal" in server.ops())
    server.send(text)
    server.send('{"op": "publish", "topic": "/a", "msg": {"data": "still here"}}')
    poll_until(node, lambda: {"data": "still here"} in got)


def test_too_large_message_ends_connection(server: ScriptedServer, monkeypatch: pytest.MonkeyPatch):
    """The limit is for the unpacked message, because websockets compress messages."""
    monkeypatch.setattr(connection, "MAX_MESSAGE_BYTES", 2**20)
    client = RosbridgeConnection(f"ws://127.0.0.1:{server.port}")
    wait_until(lambda: server.sockets, partial(time.sleep, 0.01))
    for op in ({"op": "small"}, {"op": "large", "msg": " " * 2**21}):
        server.send(json.dumps(op))
    ops: list[str] = []
    while "" not in ops:
        ops += [str(op["op"]) for op in client.receive(30)]
    client.close()
    assert ops[:2] == ["small", ""]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"transport": "dsd"}, "there is no transport 'dsd'"),
        (
            {"transport": "rosbridge", "domain": 3},
            "'domain' belongs to the transport dds or rclpy, not",
        ),
        ({"url": "ws://robot"}, "'url' belongs to the transport rosbridge, not to dds"),
    ],
)
def test_contradicting_settings_are_refused(values: dict[str, Any], message: str):
    with pytest.raises(ConfigError, match=message):
        NodeSettings.parse(values, Path(), "the robot")
