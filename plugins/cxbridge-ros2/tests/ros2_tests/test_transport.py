"""What every transport does, against peers that are ours and those of the real rclpy."""

from __future__ import annotations

import gc
import json
import os
import shlex
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Any
from unittest.mock import Mock

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge.rights import Right, Rights
from cxbridge_ros2.actions import ActionClient, CancelCode, GoalStatus, SentGoal
from cxbridge_ros2.definitions import DISTRIBUTIONS, Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.transports.dds import DdsNode
from cxbridge_ros2.transports.dds.domain import _domains
from cxbridge_ros2.transports.dds.services import (
    _Introduction,
    list_matched_handles,
    make_owner_data,
    write_data,
)
from cxbridge_ros2.transports.environment import has_rclpy
from cxbridge_ros2.transports.rclpy import RclpyNode
from cxbridge_ros2.transports.rosbridge import RosbridgeNode
from ros2_tests.conftest import (
    HERE,
    forked,
    free_port,
    needs_ros,
    poll_until,
    until,
    wait_for_port,
    with_ros,
)
from ros2_tests.peer import ABORTED, PACKAGES

COUNT = 200
AT_ONCE = 8  # a server of rclpy keeps ten requests
FIBONACCI = "example_interfaces/action/Fibonacci"


ROSBRIDGE = os.environ.get("ROSBRIDGE", "")
"""A command that starts a real rosbridge; the port is added."""


REAL = "real rosbridge"
RCLPY = "by rclpy"


@contextmanager
def a_bridge(kind: str) -> Iterator[str]:
    """Start a rosbridge; its URL."""
    port = free_port()
    if kind == "rosbridge":
        with forked("ros2_tests.bridge", str(port)):
            yield f"ws://127.0.0.1:{port}"
        return
    command = [*shlex.split(ROSBRIDGE), str(port)]
    with subprocess.Popen(command, cwd=HERE.parent.parent, stdout=subprocess.DEVNULL) as process:
        try:
            wait_for_port(port)
            yield f"ws://127.0.0.1:{port}"
        finally:
            process.kill()


@pytest.fixture(
    scope="module",
    params=[
        "dds",
        pytest.param(
            RCLPY,
            marks=pytest.mark.skipif(not has_rclpy(), reason="no ROS 2 environment is sourced"),
        ),
        "rosbridge",
        pytest.param(
            REAL,
            marks=pytest.mark.skipif(not ROSBRIDGE, reason="ROSBRIDGE names no command that starts one"),
        ),
    ],
)
def transport(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture(scope="module")
def node(domain: int, transport: str) -> Iterator[Node]:
    types = Definitions([PACKAGES], environment={})
    if transport == "dds":
        with DdsNode("test", types) as node:
            yield node
        return
    if transport == RCLPY:
        with RclpyNode("test", types) as node:
            yield node
        return
    with a_bridge(transport) as url, RosbridgeNode("test", types, url) as bridged:
        yield bridged


def test_each_message_comes_back_once_and_in_order(node: Node, peer: str):
    got: list[str] = []
    many = QosProfile(depth=COUNT)
    end = node.subscribe("/back", "std_msgs/msg/String", lambda each: got.append(each["data"]), many)
    there = node.create_publisher("/there", "std_msgs/msg/String", many)
    poll_until(node, there.count_subscriptions)
    while not got:  # until the peer has found our subscription
        there.publish({"data": "first"})
        node.poll(0.1)
    sent = [f"message {number} äö\t" for number in range(COUNT)]
    for each in sent:
        there.publish({"data": each})
        poll_until(node, partial(got.__contains__, each))
    assert [each for each in got if each != "first"] == sent
    end()
    there.close()


def test_each_call_of_a_service_has_its_answer(node: Node, peer: str):
    add = node.create_client("/add", "example_interfaces/srv/AddTwoInts")
    poll_until(node, lambda: add.has_server)
    first: list[object] = []
    while not first:  # a bridge refuses calls of a service that it has not found yet
        refused: list[str] = []
        add.call({"a": 1, "b": 1}, first.append, refused.append)
        poll_until(node, lambda: first or refused)  # noqa: B023 - it is over before the next one
    answers: dict[int, int] = {}
    for number in range(COUNT):
        add.call({"a": number, "b": 2**40}, lambda each: answers.update({each["sum"] - 2**40: each["sum"]}))
        if number >= AT_ONCE:
            poll_until(node, partial(answers.__contains__, number - AT_ONCE), 30)
    poll_until(node, lambda: len(answers) == COUNT, 60)
    assert answers == {number: number + 2**40 for number in range(COUNT)}
    add.close()


@pytest.fixture(scope="module")
def count(node: Node, peer: str) -> Iterator[ActionClient]:
    with ActionClient(node, "/fibonacci", FIBONACCI) as client:
        poll_until(node, lambda: client.has_server)
        poll_until(node, lambda: not node.poll(0.5))
        yield client


def play(node: Node, sent: SentGoal) -> SentGoal:
    poll_until(node, lambda: sent.is_over)
    return sent


def test_a_goal_is_accepted_tells_how_far_it_is_and_succeeds(node: Node, count: ActionClient):
    end_s = time.monotonic() + 30
    feedback: object = None
    result = {"sequence": [0, 1, 1, 2, 3, 5, 8]}
    while feedback != result and time.monotonic() < end_s:  # ROS loses it until the server has found us
        sent = play(node, count.send({"order": 6}))
        assert sent.status is GoalStatus.SUCCEEDED
        assert sent.result == result
        feedback = sent.feedback
    assert feedback == result


def test_a_goal_is_rejected(node: Node, count: ActionClient, transport: str):
    if transport == REAL:
        pytest.skip("the real rosbridge never answers a goal that is rejected")
    sent = play(node, count.send({"order": -1}))
    assert sent.is_accepted is False or sent.reason == "Action goal was rejected"
    assert not sent.result


def test_a_goal_is_aborted(node: Node, count: ActionClient):
    sent = play(node, count.send({"order": ABORTED}))
    assert sent.status is GoalStatus.ABORTED
    assert sent.result is not None
    assert len(sent.result["sequence"]) == ABORTED + 1


def test_a_goal_is_cancelled(node: Node, count: ActionClient):
    sent = count.send({"order": 1000})
    poll_until(node, lambda: sent.feedback)
    sent.cancel()
    play(node, sent)
    assert sent.status is GoalStatus.CANCELED
    assert sent.result is not None
    assert 2 < len(sent.result["sequence"]) < 1000


@pytest.mark.parametrize("is_known", [False, True])
def test_a_goal_is_cancelled_in_the_moment_it_is_sent_or_accepted(
    node: Node, count: ActionClient, is_known: bool
):
    sent = count.send({"order": 1000})
    if is_known:
        poll_until(node, lambda: sent.is_accepted)
    sent.cancel()
    play(node, sent)
    assert sent.status is GoalStatus.CANCELED


def test_a_goal_that_is_over_is_not_cancelled(node: Node, count: ActionClient):
    if isinstance(node, RosbridgeNode):
        pytest.skip("a rosbridge reports nothing about goals that are over")
    sent = play(node, count.send({"order": 2}))
    sent.cancel()
    poll_until(node, lambda: sent.cancel_refusal)
    assert sent.cancel_refusal in (CancelCode.GOAL_TERMINATED, CancelCode.REJECTED)


def test_many_goals_at_once_each_have_their_result(node: Node, count: ActionClient):
    sent = [count.send({"order": number}) for number in range(1, 9)]
    for each in sent:
        play(node, each)
    assert [len(each.result["sequence"]) for each in sent if each.result] == [2, *range(3, 10)]


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_services_work_with_the_types_of_each_distribution(domain: int, distribution: str):
    types = Definitions([PACKAGES], distribution, environment={})
    with DdsNode("server", types, domain + 5) as node:
        node.serve("/sum", "example_interfaces/srv/AddTwoInts", lambda each: {"sum": each["a"] + each["b"]})
        client = node.create_client("/sum", "example_interfaces/srv/AddTwoInts")
        got: list[object] = []
        client.call({"a": 1, "b": 2}, got.append)
        poll_until(node, lambda: got)
        assert got == [{"sum": 3}]
        client.close()


def test_a_subscription_that_has_ended_wakes_nobody(node: Node):
    got: list[object] = []
    end = node.subscribe("/mine", "std_msgs/msg/String", got.append)
    mine = node.create_publisher("/mine", "std_msgs/msg/String")
    mine.publish({"data": "one"})
    poll_until(node, lambda: got)
    end()
    mine.publish({"data": "two"})
    end_s, polls = time.monotonic() + 0.5, 0
    while time.monotonic() < end_s:
        node.poll(0.05)
        polls += 1
    assert polls < 50  # ten, and some for messages of other nodes; a thousand when it is woken all the time
    assert [each for each in got if each != {"data": "one"}] == []
    mine.close()


def test_requests_and_messages_without_the_right_reach_nobody(node: Node, monkeypatch: pytest.MonkeyPatch):
    """Whatever the transport is: what names no right needs the highest."""
    refused: list[str] = []
    monkeypatch.setattr(node, "rights", Rights(control=True, programs=False))
    monkeypatch.setattr(node, "complain", lambda _kind, text: refused.append(text))
    asked: list[Any] = []

    def add(request: Any) -> dict[str, int]:
        asked.append(request)
        return {"sum": request["a"] + request["b"]}

    kind = "example_interfaces/srv/AddTwoInts"
    ends = [
        node.serve("/open_service", kind, add, right=Right.CONTROL),
        node.serve("/forgotten_service", kind, add, make_refusal=lambda _request, _reason: {"sum": -1}),
        node.subscribe("/here", "std_msgs/msg/String", asked.append, right=Right.CONTROL),
        node.subscribe("/here", "std_msgs/msg/String", asked.append),
    ]
    for service, answer in (("/open_service", 3), ("/forgotten_service", -1)):
        client = node.create_client(service, kind)
        got: list[Any] = []
        while not got:
            poll_until(node, lambda: client.has_server)  # noqa: B023 - it is over before the next one
            failed: list[str] = []  # a bridge refuses calls of a service that it has not found yet
            client.call({"a": 1, "b": 2}, got.append, failed.append)
            poll_until(node, lambda: got or failed)  # noqa: B023
        assert got[0] == {"sum": answer}
        client.close()
    assert [each for each in asked if "a" not in each] == []
    asked.clear()
    here = node.create_publisher("/here", "std_msgs/msg/String")
    poll_until(node, here.count_subscriptions)
    here.publish({"data": "one"})
    poll_until(node, lambda: asked and any(text.startswith("refused: /here: ") for text in refused))
    assert asked == [{"data": "one"}]
    assert any(text.startswith("refused: /forgotten_service: ") for text in refused)
    for end in ends:
        end()
    here.close()


@needs_ros
def test_rclpy_uses_what_we_serve(peer: str, transport: str):
    if transport != "dds":
        pytest.skip("the peer is reached as on DDS")
    done = subprocess.run(
        with_ros(str(HERE / "with_rclpy/user.py"), str(COUNT)),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["got"] == [f"message {number}" for number in range(COUNT)]
    assert found["sums"] == list(range(1, COUNT + 1))
    goals = found["goals"]
    assert goals["done"] | {"feedback": 4} == {
        "accepted": True,
        "status": 4,
        "result": [0, 1, 1, 2, 3, 5],
        "feedback": 4,
        "cancel": None,
    }
    assert goals["rejected"] == {"accepted": False}
    cancelled = goals["cancelled"]
    assert (goals["aborted"]["status"], cancelled["status"], cancelled["cancel"]) == (6, 5, 0)
    assert "peer" in found["nodes"]
    types = found["types"] | found["of_peer"] | found["services_of_peer"]
    assert (
        types.items()
        >= {
            "/back": ["std_msgs/msg/String"],
            "/fibonacci/_action/feedback": [f"{FIBONACCI}_FeedbackMessage"],
            "/add": ["example_interfaces/srv/AddTwoInts"],
        }.items()
    )
    assert not done.stderr, f"{peer}: {done.stderr}"


def test_a_domain_is_gone_with_its_last_node(domain: int):
    nodes = [DdsNode(name, Definitions(environment={}), domain + 4) for name in ("first", "second")]
    for node in nodes:
        assert domain + 4 in _domains
        node.close()
        node.close()  # once more changes nothing
    assert domain + 4 not in _domains


def test_a_domain_ends_when_the_garbage_collector_takes_a_node(domain: int):
    for _ in range(3):
        with DdsNode("one", Definitions(environment={}), domain + 6) as node:
            node.subscribe("/news", "std_msgs/msg/String", lambda _message: None)
            cycle: list[object] = [node]
            cycle.append(cycle)
        del node, cycle
        gc.collect()


ADD = "example_interfaces/srv/AddTwoInts"
TYPES = Definitions([PACKAGES], environment={})

Replies = list[Callable[[dict[str, Any]], None]]


@pytest.fixture
def server(domain: int) -> Iterator[DdsNode]:
    with DdsNode("server", TYPES, domain + 7) as node:
        yield node


@pytest.fixture
def asks(domain: int) -> Iterator[DdsNode]:
    with DdsNode("asks", TYPES, domain + 7) as node:
        yield node


def test_a_response_waits_until_its_reader_is_found(server: DdsNode, asks: DdsNode):
    """DDS finds the writer of a request and the reader of its response one by one."""
    kind, codec, got = parse_type(ADD, "srv"), Codec(TYPES), list[bytes]()
    request, response = kind.derive("Request"), kind.derive("Response")
    qos, whose = PROFILES["services_default"], make_owner_data("clientid")
    server.serve("/late", ADD, lambda each: {"sum": each["a"] + each["b"]})
    writer = asks._open_writer("rq/lateRequest", request, qos, whose)
    introduction = _Introduction(writer)
    poll_until(server, lambda: introduction.filter_introduced(frozenset(writer.get_matched_subscriptions())))
    made = codec.encode(request, {"a": 1, "b": 2})
    write_data(writer, made[:4] + bytes(16) + made[4:])
    poll_until(server, lambda: server._servers[0]._unsent_responses)
    asks._open_reader("rr/lateReply", response, qos, lambda sample: got.append(sample.cdr), whose)
    poll_until(asks, lambda: server.poll() or got)
    poll_until(asks, lambda: got)
    assert codec.decode(response, got[0][:4] + got[0][20:]) == {"sum": 3}
    assert not server._servers[0]._unsent_responses


def test_what_has_ended_is_gone_for_others_and_does_nothing_more(server: DdsNode, asks: DdsNode):
    replies: Replies = []
    end = server.serve_later("/ends", ADD, lambda _request, reply: replies.append(reply))
    client = asks.create_client("/ends", ADD)
    for _ in range(2):
        poll_until(asks, lambda: client.has_server)
        client.call({"a": 1}, lambda _message: None)
    poll_until(server, lambda: len(replies) == 2)
    end()
    end()
    replies[0]({"sum": 1})  # the server has ended: nothing happens
    poll_until(asks, lambda: not client.has_server)
    client.close()
    assert not client.has_server
    client.close()
    server.close()
    replies[1]({"sum": 1})


def test_a_response_to_a_client_that_is_gone_is_dropped(server: DdsNode, asks: DdsNode):
    replies: Replies = []
    server.serve_later("/late", ADD, lambda _request, reply: replies.append(reply))
    client = asks.create_client("/late", ADD)
    poll_until(asks, lambda: client.has_server)
    client.call({"a": 1, "b": 2}, lambda _message: None)
    poll_until(server, lambda: replies)
    client.close()
    poll_until(server, lambda: not server._servers[0]._response_readers.update())
    replies[0]({"sum": 3})
    poll_until(server, lambda: not server._servers[0]._unsent_responses)


def test_an_endpoint_that_comes_while_the_wheel_counts_is_counted():
    """The wheel asks for a number, then for that many handles, and fails when a reader came in between."""
    assert list_matched_handles(Mock(side_effect=[IndexError("invalid index"), [1, 2]])) == [1, 2]


def test_a_cancel_that_came_before_the_goal_was_accepted_is_sent_again(server: DdsNode, asks: DdsNode):
    replies: Replies = []
    codes: list[int] = []

    def cancelled(_request: object) -> dict[str, Any]:
        codes.append(CancelCode.NONE if codes else CancelCode.UNKNOWN_GOAL_ID)
        return {"return_code": codes[-1]}

    polls = partial(asks.poll, 0.05), server.poll
    server.serve_later(
        "/slow/_action/send_goal", f"{FIBONACCI}_SendGoal", lambda _request, reply: replies.append(reply)
    )
    server.serve_later("/slow/_action/get_result", f"{FIBONACCI}_GetResult", lambda _request, _reply: None)
    server.serve("/slow/_action/cancel_goal", "action_msgs/srv/CancelGoal", cancelled)
    with ActionClient(asks, "/slow", FIBONACCI) as client:
        until(lambda: client.has_server, *polls)
        sent = client.send({"order": 1})
        sent.cancel()
        until(lambda: replies and sent.cancel_refusal, *polls)
        replies[0]({"accepted": True})
        until(lambda: len(codes) > 1 and sent.cancel_refusal is None, *polls)
