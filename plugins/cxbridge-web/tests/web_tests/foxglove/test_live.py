"""The server for Foxglove with a client of the published protocol."""

from __future__ import annotations

import json
import socket
import sys
import threading
from typing import Any

import jsonschema_rs
import pytest

from cxbridge.clock import RealClock
from cxbridge.daemon.daemon import Daemon
from cxbridge.daemon.options import DaemonOptions
from cxbridge.errors import CxbridgeError
from cxbridge.events import EventBus, GoalTransition, Level, LogLine
from cxbridge.extras import install_command
from cxbridge.space.tf import StampedTransform, Transform, TransformPublisher
from cxbridge.trace.codec import event_json_schema
from cxbridge_web.foxglove.settings import FoxgloveSettings
from cxbridge_web.servers.foxglove import make_foxglove_server
from tests.daemon.test_daemon import QUIET, running
from tests.support import ROOT
from web_tests.foxglove.client import FoxgloveClient, connected
from web_tests.foxglove.published import check_message
from web_tests.foxglove.test_messages import graph, pose, transform

pytest.importorskip("foxglove", reason="needs foxglove-sdk")

LIVE: tuple[tuple[str, Any], ...] = (*QUIET, ("foxglove/enable", True), ("foxglove/port", 0))
WAYPOINTS = ROOT / "scenarios" / "waypoints"
TOPICS = (
    "/goals",
    "/plan-actions",
    "/log",
    "/loops",
    "/bb/Position3DInterface/Pose",
    "/foxglove/log",
    "/foxglove/pose/Position3DInterface/Pose",
    "/foxglove/navgraph/waypoints",
)


def test_client_receives_valid_messages_of_each_channel():
    with running(config=WAYPOINTS, settings=(*LIVE, ("clock", "scaled:4"))) as (daemon, lines, _):
        (url,) = daemon.endpoints
        assert url.startswith("ws://127.0.0.1:")
        assert any(f"Foxglove at {url}" in line for line in lines)
        with connected(url) as client:
            client.until(lambda: client.has(*TOPICS))
    check_messages(client)
    (_, scene) = client.messages["/foxglove/navgraph/waypoints"][0]
    assert len(scene["entities"][0]["spheres"]) == 8


def test_client_receives_skills_and_transforms():
    scenario = ROOT / "scenarios" / "test-scenario"
    with (
        running(config=scenario, settings=LIVE) as (daemon, _, _),
        connected(daemon.endpoints[0]) as client,
    ):
        client.until(lambda: client.has("/skills", "/goals"))
        publisher = TransformPublisher(daemon.board, "base_link")
        publisher.send(StampedTransform(Transform((1.0, 2.0, 0.0)), 1_000_000, "map", "base_link"))
        client.until(lambda: client.has("/foxglove/tf"))
        publisher.close()
    check_messages(client)
    (_, transform_data) = client.messages["/foxglove/tf"][0]
    assert transform_data["translation"] == {"x": 1.0, "y": 2.0, "z": 0.0}


def check_messages(client: FoxgloveClient) -> None:
    """Check all messages against the advertised schemas and against Foxglove's published schemas."""
    for topic, messages in client.messages.items():
        channel = client.channels[topic]
        assert (channel["encoding"], channel["schemaEncoding"]) == ("json", "jsonschema")
        schema = json.loads(channel["schema"])
        assert schema["title"] == channel["schemaName"]
        validator = jsonschema_rs.validator_for(schema)
        for time_ns, data in messages:
            validator.validate(data)
            assert time_ns > 0
            if topic.startswith("/foxglove/"):
                check_message(channel["schemaName"].removeprefix("foxglove."), data)
    goal_channel = client.channels["/goals"]
    assert goal_channel["schemaName"] == "cxbridge.GoalTransition"
    assert json.loads(goal_channel["schema"]) == event_json_schema(GoalTransition)


def serve_subscribers(server: Any, stopped: threading.Event) -> None:
    """Serve new subscribers, like the main loop."""
    while not stopped.wait(0.01):
        server.serve_new_subscribers()


@pytest.fixture
def server():
    bus = EventBus(RealClock())
    foxglove_server = make_foxglove_server(bus, FoxgloveSettings(port=0))
    foxglove_server.start()
    yield bus, foxglove_server
    foxglove_server.stop()


def test_late_client_gets_latest_transforms_graph_and_goals(server):
    """A map needs the static transform and the graph, which are written only once."""
    bus, foxglove_server = server
    for event in (transform(), transform(child_frame="laser", frame="base_link"), graph(), pose()):
        bus.emit(event)
    bus.emit(LogLine(1, Level.INFO, "Test", "short-lived"))
    bus.emit(GoalTransition(1, "executive", "G", "C", "nil", "nil", "FORMULATED", "UNKNOWN", ""))
    bus.emit(GoalTransition(2, "executive", "G", "C", "nil", "nil", "SELECTED", "UNKNOWN", ""))
    with connected(foxglove_server.url) as client:
        client.until(lambda: "/log" in client.channels)
        loop_stopped = threading.Event()
        loop = threading.Thread(target=serve_subscribers, args=(foxglove_server, loop_stopped))
        loop.start()
        try:
            client.until(
                lambda: (
                    client.has(
                        "/goals", "/foxglove/navgraph/House", "/foxglove/pose/Position3DInterface/Pose"
                    )
                    and len(client.messages.get("/foxglove/tf", ())) >= 2
                )
            )
        finally:
            loop_stopped.set()
            loop.join()
    frames = {data["child_frame_id"] for _, data in client.messages["/foxglove/tf"]}
    assert frames == {"base_link", "laser"}
    assert {data["mode"] for _, data in client.messages["/goals"]} == {"SELECTED"}
    assert "/log" not in client.messages


def request_upgrade(foxglove_server: Any, *fields: str) -> bytes:
    """Request the protocol with header ``fields``, and return the first line of the answer."""
    port = int(foxglove_server.url.rpartition(":")[2])
    head = [
        "GET / HTTP/1.1",
        "Upgrade: websocket",
        "Connection: Upgrade",
        "Sec-WebSocket-Version: 13",
        "Sec-WebSocket-Key: AAAAAAAAAAAAAAAAAAAAAA==",
        "Sec-WebSocket-Protocol: foxglove.sdk.v1",
        *fields,
    ]
    with socket.create_connection(("127.0.0.1", port), timeout=10) as peer:
        peer.sendall("".join(f"{line}\r\n" for line in (*head, "")).encode())
        return peer.makefile("rb").readline().strip()


@pytest.mark.parametrize(
    ("fields", "status"),
    [
        (["Host: localhost:8765"], b"101"),
        (["Host: 127.0.0.1:1"], b"101"),
        (["Host: localhost", "Origin: https://app.foxglove.dev"], b"101"),
        (["Host: localhost", "Origin: file://"], b"101"),
        (["Host: localhost", "origin:http://evil.example"], b"403"),
        (["Host: localhost", "ORIGIN: null"], b"403"),
        (["Host: localhost", "Origin: http://localhost:8088"], b"403"),
        (["Host: evil.example:8765"], b"421"),
        (["Host: localhost", "Host: localhost"], b"400"),
        (["Host: localhost", "Origin: file://", "Origin: http://evil.example"], b"400"),
        ([], b"400"),
    ],
)
def test_server_checks_host_and_origin(server, fields, status):
    """The server of foxglove-sdk accepts each origin, so each page in the browser could read the run."""
    _, foxglove_server = server
    assert request_upgrade(foxglove_server, *fields).split()[1] == status


def test_host_beyond_loopback_needs_insecure_setting(tmp_path):
    with pytest.raises(CxbridgeError, match=r"0\.0\.0\.0 could be reached"):
        make_foxglove_server(EventBus(RealClock()), FoxgloveSettings(host="0.0.0.0", port=0))
    file = tmp_path / "daemon.yaml"
    file.write_text("cxbridge: {foxglove: {host: 0.0.0.0, port: 0}}\n")
    with pytest.raises(CxbridgeError, match="foxglove/insecure"):
        Daemon(DaemonOptions(config=file))
    foxglove_server = make_foxglove_server(
        EventBus(RealClock()), FoxgloveSettings(host="0.0.0.0", port=0, insecure=True)
    )
    foxglove_server.start()
    try:
        assert request_upgrade(foxglove_server, "Host: robot:8765").split()[1] == b"101"
        assert (
            request_upgrade(foxglove_server, "Host: robot:8765", "Origin: http://evil.example").split()[1]
            == b"403"
        )
    finally:
        foxglove_server.stop()


def test_too_long_request_is_disconnected(server):
    _, foxglove_server = server
    port = int(foxglove_server.url.rpartition(":")[2])
    with socket.create_connection(("127.0.0.1", port), timeout=20) as peer:
        peer.sendall(b"GET / HTTP/1.1\r\n" + b"X: y\r\n" * 10_000)
        assert peer.recv(1) == b""


def test_missing_package_is_error_with_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "foxglove", None)
    monkeypatch.delitem(sys.modules, "cxbridge_web.foxglove.server", raising=False)
    with pytest.raises(CxbridgeError, match="need the package 'foxglove'") as caught:
        make_foxglove_server(EventBus(RealClock()), FoxgloveSettings())
    assert caught.value.hint == install_command("foxglove", "cxbridge-web")
