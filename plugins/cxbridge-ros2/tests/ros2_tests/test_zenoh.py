"""ROS 2 over Zenoh: names compared with other implementations, and vanishing peers.

The names, numbers and attachments marked so are those of rmw_zenoh_cpp: the examples of its design document
(release 0.12), and what its own functions (release 0.2.10, Jazzy) have printed for these tokens.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

pytest.importorskip("zenoh", reason="the extra zenoh is not installed")

from cxbridge import extras
from cxbridge.errors import ConfigError, Ros2Error
from cxbridge.rights import ALL_RIGHTS
from cxbridge_ros2.actions import ActionClient
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Node, Ros2Warning
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.settings import NodeSettings
from cxbridge_ros2.transports.zenoh import ZenohNode
from cxbridge_ros2.transports.zenoh.graph import RosGraph
from cxbridge_ros2.transports.zenoh.inbox import InboxSource, MessageInbox
from cxbridge_ros2.transports.zenoh.names import (
    GraphEndpoint,
    MessageAttachment,
    NodeName,
    TypedName,
    format_qos,
    make_typed_name,
    parse_attachment,
    parse_token,
)
from cxbridge_ros2.transports.zenoh.session import make_session_settings, parse_overrides
from ros2_tests.conftest import a_router, forked, free_port
from ros2_tests.peer import PACKAGES
from ros2_tests.test_transport import poll_until

STRING = "RIHS01_df668c740482bbd48fb39d76a70dfd4bd59db1288021743503259e948f6b1a18"
ADD = "RIHS01_e118de6bf5eeb66a2491b5bda11202e7b68f198d6f67922cf30364858239c81a"
CHATTER = TypedName("/chatter", "std_msgs::msg::dds_::String_", STRING)
AT_ONCE = "scouting/delay=0"
"""Lets a session begin at once, not after the half second in which Zenoh looks for peers."""

ADDITION = TypedName("/add_two_ints", "example_interfaces::srv::dds_::AddTwoInts_", ADD)
ODOM = TypedName("/robot1/odom", "nav_msgs::msg::dds_::Odometry_", "TypeHashNotSupported")

TOKENS = {  # with the number (GID) where a function of rmw_zenoh_cpp has printed it
    f"@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/10/MS/%/%/listener/%chatter/{CHATTER.dds_type}/{STRING}"
    "/::,10:,:,:,,": (
        GraphEndpoint(
            NodeName(0, "aac3178e146ba6f1fc6e6a4085e77f21", 0, "listener"), 10, "MS", CHATTER, QosProfile()
        ),
        "",
    ),
    f"@ros2_lv/0/8b20917502ee955ac4476e0266340d5c/0/10/MP/%/%/talker/%chatter/{CHATTER.dds_type}/{STRING}"
    "/::,7:,:,:,,": (
        GraphEndpoint(
            NodeName(0, "8b20917502ee955ac4476e0266340d5c", 0, "talker"),
            10,
            "MP",
            CHATTER,
            QosProfile(depth=7),
        ),
        "eb85fa883b7846dc448a4501890ad062",
    ),
    f"@ros2_lv/0/f9980ee0495eaafb3e38f0d19e2eae12/0/10/SS/%/%/add_two_ints_server/%add_two_ints/{ADDITION.dds_type}/{ADD}"
    "/::,10:,:,:,,": (
        GraphEndpoint(
            NodeName(0, "f9980ee0495eaafb3e38f0d19e2eae12", 0, "add_two_ints_server"),
            10,
            "SS",
            ADDITION,
            QosProfile(),
        ),
        "d47771a4e2405c092088d4552a3b7b13",
    ),
    f"@ros2_lv/0/e1dc8d1b45ae8717fce78689cc655685/0/10/SC/%/%/add_two_ints_client/%add_two_ints/{ADDITION.dds_type}/{ADD}"
    "/::,10:,:,:,,": (
        GraphEndpoint(
            NodeName(0, "e1dc8d1b45ae8717fce78689cc655685", 0, "add_two_ints_client"),
            10,
            "SC",
            ADDITION,
            QosProfile(),
        ),
        "",
    ),
    f"@ros2_lv/3/ab/0/4/MS/%/%robot1/a/%robot1%odom/{ODOM.dds_type}/TypeHashNotSupported/2:1:,5:,:,:,,": (
        GraphEndpoint(
            NodeName(3, "ab", 0, "a", "/robot1"),
            4,
            "MS",
            ODOM,
            QosProfile("best_effort", "transient_local", 5),
        ),
        "b03bfcf70f7f0c407237dc9223ad1229",
    ),
    "@ros2_lv/0/ab/0/4/MS/%/%/a/%x/T/H/::,:,:,:,,": (
        GraphEndpoint(NodeName(0, "ab", 0, "a"), 4, "MS", TypedName("/x", "T", "H"), QosProfile(depth=42)),
        "e64fd7ef6be88f41c77621acca706610",
    ),
}


@pytest.mark.parametrize("token", TOKENS, ids=lambda each: each.split("/")[8])
def test_tokens_are_those_of_rmw_zenoh(token: str):
    endpoint, gid = TOKENS[token]
    assert endpoint.token == token
    assert parse_token(token) == (endpoint.kind, endpoint.topic)
    assert not gid or endpoint.gid.hex() == gid


def test_the_token_of_a_node_is_that_of_rmw_zenoh():
    token = "@ros2_lv/0/aac3178e146ba6f1fc6e6a4085e77f21/0/0/NN/%/%/listener"
    assert NodeName(0, "aac3178e146ba6f1fc6e6a4085e77f21", 0, "listener").token == token
    assert parse_token(token) is None


def test_keys_are_those_of_rmw_zenoh():
    assert CHATTER.make_key(0) == f"0/chatter/std_msgs::msg::dds_::String_/{STRING}"
    assert TypedName("/robot1/chatter", CHATTER.dds_type, STRING).make_key(0) == (
        f"0/robot1/chatter/std_msgs::msg::dds_::String_/{STRING}"
    )
    assert ADDITION.make_key(2) == f"2/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/{ADD}"


def test_types_have_the_hashes_of_rmw_zenoh():
    types = Definitions([PACKAGES], environment={})
    assert make_typed_name("/chatter", parse_type("std_msgs/msg/String"), types) == CHATTER
    add = parse_type("example_interfaces/srv/AddTwoInts")
    assert make_typed_name("/add_two_ints", add, types, is_service=True) == ADDITION
    humble = Definitions([PACKAGES], "humble", environment={})
    assert make_typed_name("/add_two_ints", add, humble, is_service=True).make_key(0) == (
        "0/add_two_ints/example_interfaces::srv::dds_::AddTwoInts_/TypeHashNotSupported"
    )
    with pytest.raises(Ros2Error, match="Nothing"):
        make_typed_name("/x", parse_type("std_msgs/msg/Nothing"), humble)


@pytest.mark.parametrize(
    ("text", "qos"),
    [
        ("::,10:,:,:,,", QosProfile()),
        ("2::,5:,:,:,,", PROFILES["sensor_data"]),
        (":1:,1:,:,:,,", PROFILES["latched"]),
        ("::,:,:,:,,", QosProfile(depth=42)),
    ],
)
def test_the_text_of_a_qos(text: str, qos: QosProfile):
    assert format_qos(qos) == text


def test_a_token_with_memory_elsewhere_is_read():
    token, (endpoint, _) = next(iter(TOKENS.items()))
    assert parse_token(f"{token}/backends:cpu:") == (endpoint.kind, endpoint.topic)  # Lyrical adds this


def test_attachments_are_those_of_rmw_zenoh():
    gid = bytes.fromhex("eb85fa883b7846dc448a4501890ad062")
    made = MessageAttachment(7, 1700000000123456789, gid)
    data = bytes.fromhex("070000000000000015cd853dfe9c971710eb85fa883b7846dc448a4501890ad062")
    assert bytes(made) == data
    assert parse_attachment(data) == made
    assert parse_attachment(data[:-1]) is None
    assert parse_attachment(b"\x0fsequence_number" + data[:18]) is None  # as until the beginning of 2025


PARTS = st.one_of(
    st.sampled_from(["@ros2_lv", "0", "MP", "SS", "NN", "%", "", "::,10:,:,:,,", "²", "9" * 5000]), st.text()
)


@given(st.one_of(st.text(), st.lists(PARTS, max_size=15).map("/".join)))
def test_no_token_of_a_stranger_raises(token: str):
    graph = RosGraph()
    graph.add(token)
    graph.remove(token)


@given(st.binary(max_size=40))
def test_no_attachment_of_a_stranger_raises(data: bytes):
    found = parse_attachment(data)
    assert found is None or bytes(found) == data


def test_a_graph_knows_who_is_there():
    graph, (token, (endpoint, _)) = RosGraph(), next(iter(TOKENS.items()))
    graph.add(token)
    graph.add(token)
    (first,) = graph.find_endpoint_numbers("MS", endpoint.topic)
    assert not graph.find_endpoint_numbers("MP", endpoint.topic)
    graph.remove(token)
    graph.remove(token)
    assert not graph.find_endpoint_numbers("MS", endpoint.topic)
    graph.add(token)
    assert graph.find_endpoint_numbers("MS", endpoint.topic) != {first}  # it may be another one by now


def test_an_inbox_drops_what_is_oldest():
    inbox, got = MessageInbox(), list[object]()
    short, long = InboxSource(got.append, 2), InboxSource(got.append, 0)
    for number in range(4):
        inbox.put(short, ("short", number))
        inbox.put(long, ("long", number))
    assert inbox.deliver(0)
    assert got == [("long", 0), ("long", 1), ("short", 2), ("long", 2), ("short", 3), ("long", 3)]
    assert not inbox.deliver(0)


def test_an_inbox_forgets_what_has_ended():
    inbox, got = MessageInbox(), list[object]()
    second = InboxSource(got.append, 5)
    first = InboxSource(lambda _item: inbox.close_source(second), 5)
    inbox.put(first, 1)
    inbox.put(second, 2)
    assert inbox.deliver(0)
    inbox.put(second, 3)
    assert not inbox.deliver(0)
    assert got == []


@pytest.mark.parametrize("url", ["", "tcp/localhost:7447", "tcp/127.0.0.1:1", "tls/[::1]:7447"])
def test_nothing_leaves_the_host(url: str):
    settings = make_session_settings(url)
    assert settings["mode"] == "peer"
    assert settings["listen/endpoints"] == ["tcp/localhost:0"]
    assert settings["scouting/multicast/enabled"] is False


@pytest.mark.parametrize("url", ["tcp/robot:7447", "tls/10.0.0.7:7447"])
def test_a_router_elsewhere_is_all_that_is_spoken_with(url: str):
    settings = make_session_settings(url)
    assert settings["mode"] == "client"
    assert settings["connect/endpoints"] == [url]
    assert "listen/endpoints" not in settings


def test_overrides_are_read_as_rmw_zenoh_does():
    text = 'listen/endpoints=["tcp/127.0.0.1:7448"];scouting/multicast/enabled=true;;x'
    assert list(parse_overrides(text)) == [
        ("listen/endpoints", '["tcp/127.0.0.1:7448"]'),
        ("scouting/multicast/enabled", "true"),
    ]


@pytest.fixture
def plain(monkeypatch: pytest.MonkeyPatch, domain: int) -> int:
    for name in ("ZENOH_SESSION_CONFIG_URI", "ZENOH_ROUTER_CHECK_ATTEMPTS"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", AT_ONCE)
    return domain


def types(distribution: str = "jazzy") -> Definitions:
    return Definitions([PACKAGES], distribution, environment={})


def test_no_router_is_one_clear_error(plain: int):
    url = f"tcp/127.0.0.1:{free_port()}"
    with pytest.raises(Ros2Error, match=rf"no Zenoh router at {url}: .*refused") as caught:
        ZenohNode("test", types(), url, plain)
    assert "rmw_zenohd" in (caught.value.hint or "")


def test_a_router_is_waited_for(plain: int, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ZENOH_ROUTER_CHECK_ATTEMPTS", "-1")
    with ZenohNode("test", types(), f"tcp/127.0.0.1:{free_port()}", plain) as node:
        assert not node.poll()


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("ZENOH_ROUTER_CHECK_ATTEMPTS", "often"),
        ("ZENOH_CONFIG_OVERRIDE", "mode=[1]"),
        ("ZENOH_SESSION_CONFIG_URI", "/nowhere.json5"),
        ("ROS_DOMAIN_ID", "home"),
    ],
)
def test_an_environment_that_makes_no_sense(
    plain: int, monkeypatch: pytest.MonkeyPatch, name: str, value: str
):
    monkeypatch.setenv(name, value)
    with pytest.raises(Ros2Error, match=name):
        ZenohNode("test", types())


def test_a_url_that_is_none(plain: int):
    with pytest.raises(Ros2Error, match="robot"):
        ZenohNode("test", types(), "robot", plain)


def test_the_session_settings_a_configuration(plain: int):
    with a_router() as url:
        settings = NodeSettings.parse({"transport": "zenoh", "url": url, "domain": plain}, Path(), "it")
        with settings.join("test", types(), None, ALL_RIGHTS) as node:
            assert isinstance(node, ZenohNode)
    with pytest.raises(ConfigError, match="'reach' belongs to"):
        NodeSettings.parse({"transport": "zenoh", "reach": "subnet"}, Path(), "it")


def test_a_file_of_the_user_configures_it(plain: int, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    with a_router() as url:
        file = tmp_path / "session.json5"
        file.write_text(f'{{mode: "client", connect: {{endpoints: ["{url}"]}}}}')
        monkeypatch.setenv("ZENOH_SESSION_CONFIG_URI", str(file))
        with ZenohNode("test", types()) as node:
            assert not node.poll()


def test_the_extra_is_named_when_it_is_missing():
    error = extras.missing_package_error(ModuleNotFoundError("no zenoh", name="zenoh"))
    assert error is not None
    assert "cxbridge-ros2[zenoh]" in (error.hint or "") or "eclipse-zenoh" in (error.hint or "")


# --- who comes late, and who goes away ----------------------------------------------------------------------


@pytest.fixture(params=["peer", "client"])
def two(
    plain: int, request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch
) -> Iterator[tuple[Node, Node]]:
    """Two nodes: as on one host, and as with a router elsewhere."""
    with a_router() as url:
        monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", f'mode="{request.param}";{AT_ONCE}')
        with ZenohNode("first", types(), url, plain) as first, ZenohNode("second", types(), url) as second:
            yield first, second


def poll_both(two: tuple[Node, Node], condition: Callable[[], Any]) -> None:
    def both() -> bool:
        two[1].poll()
        return bool(condition())

    poll_until(two[0], both, 60)


def test_who_comes_late_gets_the_last_messages(two: tuple[Node, Node]):
    latched = QosProfile(durability="transient_local", depth=3)
    publisher = two[0].create_publisher("/kept", "std_msgs/msg/String", latched)
    marks: list[str] = []
    mark = two[0].create_publisher("/mark", "std_msgs/msg/String", QosProfile())
    two[1].subscribe("/mark", "std_msgs/msg/String", lambda each: marks.append(each["data"]), QosProfile())

    def is_known() -> bool:
        mark.publish({"data": "known"})
        return bool(marks)

    poll_both(two, is_known)
    for number in range(5):
        publisher.publish({"data": str(number)})
    # messages that were on their way when a subscription begins may come, too
    mark.publish({"data": "all have passed"})
    poll_both(two, lambda: "all have passed" in marks)
    got: list[str] = []
    two[1].subscribe("/kept", "std_msgs/msg/String", lambda each: got.append(each["data"]), latched)
    poll_both(two, lambda: len(got) >= 3)
    publisher.publish({"data": "new"})
    poll_both(two, lambda: "new" in got)
    assert got == ["2", "3", "4", "new"]


def nobody(what: object) -> None:
    pytest.fail(f"nobody waits for {what!r}")


def test_a_request_that_is_none_is_an_error(two: tuple[Node, Node], monkeypatch: pytest.MonkeyPatch):
    two[0].serve("/add", "example_interfaces/srv/AddTwoInts", lambda _each: {})
    client = two[1].create_client("/add", "example_interfaces/srv/AddTwoInts")
    monkeypatch.setattr(client._codec, "encode", lambda *_request: b"none")  # type: ignore[attr-defined]
    reasons: list[str] = []
    poll_both(two, lambda: client.has_server)
    client.call({}, nobody, reasons.append)
    with pytest.warns(Ros2Warning, match="/add: 4 bytes are not a example_interfaces/srv/AddTwoInts_Request"):
        poll_both(two, lambda: reasons)
    assert "4 bytes are not a example_interfaces/srv/AddTwoInts_Request" in reasons[0]


def test_a_request_whose_server_goes_fails(two: tuple[Node, Node]):
    asked: list[Any] = []
    end = two[0].serve_later("/add", "example_interfaces/srv/AddTwoInts", lambda *each: asked.append(each))
    client = two[1].create_client("/add", "example_interfaces/srv/AddTwoInts")
    poll_both(two, lambda: client.has_server)
    reasons: list[str] = []
    client.call({"a": 1}, nobody, reasons.append)
    poll_both(two, lambda: asked)
    end()
    two[0].close()
    poll_until(two[1], lambda: reasons and not client.has_server, 60)
    assert "has not answered" in reasons[0]
    asked[0][1]({"sum": 1})  # too late, and no harm


def test_a_forgotten_request_is_answered_to_nobody(two: tuple[Node, Node]):
    asked: list[Any] = []
    two[0].serve_later("/add", "example_interfaces/srv/AddTwoInts", lambda *each: asked.append(each))
    client = two[1].create_client("/add", "example_interfaces/srv/AddTwoInts")
    poll_both(two, lambda: client.has_server)
    client.forget(client.call({}, nobody, nobody))
    poll_both(two, lambda: asked)
    asked[0][1]({"sum": 1})
    end_s = time.monotonic() + 0.5
    poll_both(two, lambda: time.monotonic() > end_s)


def test_a_poll_waits_and_is_woken(two: tuple[Node, Node]):
    begin_s = time.monotonic()
    assert not two[0].poll(0.2)
    assert time.monotonic() - begin_s > 0.19
    two[0].subscribe("/x", "std_msgs/msg/String", lambda _each: None)
    publisher = two[1].create_publisher("/x", "std_msgs/msg/String")
    poll_both(two, publisher.count_subscriptions)
    publisher.publish({"data": "x"})
    assert two[0].poll(60)


def test_a_server_that_is_killed_is_gone_and_another_one_is_there(plain: int):
    with a_router() as url, ZenohNode("test", types(), url, plain) as node:
        client = node.create_client("/add", "example_interfaces/srv/AddTwoInts")
        seen = set[int]()
        for _ in range(2):
            with forked("ros2_tests.peer", "zenoh", url):
                poll_until(node, lambda: client.has_server, 60)
                assert not seen & client.server_numbers
                seen |= client.server_numbers
                got: list[Any] = []
                client.call({"a": 1, "b": 2}, got.append)
                poll_until(node, lambda: got, 60)  # noqa: B023 - it is over before the next one
                assert got == [{"sum": 3}]
            poll_until(node, lambda: not client.has_server, 60)


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_a_router_that_comes_back_is_found(plain: int, mode: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", f'mode="{mode}";{AT_ONCE}')
    port = free_port()
    with a_router(port) as url:
        node = ZenohNode("test", types(), url, plain)
        got: list[Any] = []
        node.subscribe("/back", "std_msgs/msg/String", got.append)
        there = node.create_publisher("/there", "std_msgs/msg/String")
        add = node.create_client("/add", "example_interfaces/srv/AddTwoInts")
    with node, a_router(port), forked("ros2_tests.peer", "zenoh", url):
        poll_until(node, lambda: add.has_server and there.count_subscriptions(), 60)
        while not got:
            there.publish({"data": "x"})
            node.poll(0.1)


@pytest.mark.parametrize("mode", ["peer", "client"])
def test_a_goal_fails_when_the_robot_is_lost(plain: int, mode: str, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("ZENOH_CONFIG_OVERRIDE", f'mode="{mode}";{AT_ONCE}')
    with a_router() as url, forked("ros2_tests.peer", "zenoh", url) as robot:
        node = ZenohNode("test", types(), url, plain)
        with ActionClient(node, "/fibonacci", "example_interfaces/action/Fibonacci") as client:
            poll_until(node, lambda: client.has_server, 60)
            sent = client.send({"order": 10**9})
            poll_until(node, lambda: sent.feedback, 60)
            robot.kill()
            poll_until(node, lambda: sent.is_over, 60)
    with node:
        assert "has not answered" in sent.reason


def test_nodes_that_do_not_fit_are_reported(plain: int):
    said: list[str] = []
    said_there: list[str] = []
    with (
        a_router() as url,
        ZenohNode("ours", types(), url, plain, said.append) as ours,
        ZenohNode("theirs", types(), url, plain, said_there.append) as theirs,
        ZenohNode("old", types("humble"), url, plain) as old,
    ):
        ours.subscribe("/chatter", "std_msgs/msg/String", lambda _message: None)
        client = ours.create_client("/beep", "std_srvs/srv/Trigger")
        old.create_publisher("/chatter", "std_msgs/msg/String")  # has no hash: no complaint
        theirs.create_publisher("/chatter", "std_msgs/msg/Int32")
        poll_until(ours, lambda: said)
        assert said == [
            "/chatter: another node's publisher has the type std_msgs/msg/Int32, ours has std_msgs/msg/String"
        ]
        theirs.serve("/beeep", "std_srvs/srv/Trigger", lambda _request: {})
        poll_until(ours, lambda: client.explain_missing_server() == "did you mean /beeep?")
        theirs.serve("/beep", "std_srvs/srv/SetBool", lambda _request: {})
        poll_until(ours, lambda: client.explain_missing_server() == "it is served as std_srvs/srv/SetBool")


def test_alone_nobody_serves(plain: int):
    with a_router() as url, ZenohNode("ours", types(), url, plain) as ours:
        client = ours.create_client("/beep", "std_srvs/srv/Trigger")
        assert client.explain_missing_server() == f"there is no other node in the domain {plain}"


def test_bytes_that_are_no_message_are_reported(plain: int):
    said: list[str] = []
    with a_router() as url, ZenohNode("ours", types(), url, plain, said.append) as ours:
        got: list[object] = []
        ours.subscribe("/chatter", "std_msgs/msg/String", got.append)
        publisher = ours.create_publisher("/chatter", "std_msgs/msg/String")
        ours._session.put(f"{plain}/chatter/{CHATTER.dds_type}/{STRING}", b"\0\1\0\0\xff\xff\xff\xff")
        poll_until(ours, lambda: said)
        assert said == ["/chatter: 8 bytes are not a std_msgs/msg/String"]
        publisher.publish({"data": "fine"})
        poll_until(ours, lambda: got)
        assert got == [{"data": "fine"}]
