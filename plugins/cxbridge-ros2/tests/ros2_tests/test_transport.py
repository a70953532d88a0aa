"""The tests of all transports, with peers of cxbridge and of the real rclpy."""

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
    _IntroductionCheck,
    list_matched_handles,
    make_owner_data,
    write_data,
)
from cxbridge_ros2.transports.environment import has_rclpy
from cxbridge_ros2.transports.rclpy import RclpyNode
from cxbridge_ros2.transports.rosbridge import RosbridgeNode
from ros2_tests.conftest import (
    HERE,
    free_port,
    make_ros_python_command,
    needs_ros,
    poll_until,
    run_module,
    wait_for_port,
    wait_until,
)
from ros2_tests.peer import ABORTED, PACKAGES

MESSAGE_COUNT = 200
OPEN_CALLS = 8  # the queue of an rclpy server has ten requests
FIBONACCI = "example_interfaces/action/Fibonacci"


ROSBRIDGE = os.environ.get("ROSBRIDGE", "")
"""A command that starts the real rosbridge, without the port."""


REAL_ROSBRIDGE = "real rosbridge"
RCLPY = "by rclpy"


@contextmanager
def run_bridge(kind: str) -> Iterator[str]:
    """Run a rosbridge, and return its URL."""
    port = free_port()
    if kind == "rosbridge":
        with run_module("ros2_tests.bridge", str(port)):
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
            REAL_ROSBRIDGE,
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
    with run_bridge(transport) as url, RosbridgeNode("test", types, url) as bridged:
        yield bridged


def test_each_message_returns_once_in_order(node: Node, peer: str):
    got: list[str] = []
    profile = QosProfile(depth=MESSAGE_COUNT)
    end = node.subscribe("/back", "std_msgs/msg/String", lambda each: got.append(each["data"]), profile)
    publisher = node.create_publisher("/there", "std_msgs/msg/String", profile)
    poll_until(node, publisher.count_subscriptions)
    while not got:  # until the peer has found the subscription
        publisher.publish({"data": "first"})
        node.poll(0.1)
    sent = [f"message {number} äö\t" for number in range(MESSAGE_COUNT)]
    for each in sent:
        publisher.publish({"data": each})
        poll_until(node, partial(got.__contains__, each))
    assert [each for each in got if each != "first"] == sent
    end()
    publisher.close()


def test_each_call_of_service_gets_its_response(node: Node, peer: str):
    add = node.create_client("/add", "example_interfaces/srv/AddTwoInts")
    poll_until(node, lambda: add.has_server)
    first: list[object] = []
    while not first:  # a bridge refuses calls before it has found the service
        refused: list[str] = []
        add.call({"a": 1, "b": 1}, first.append, refused.append)
        poll_until(node, lambda: first or refused)  # noqa: B023 - the loop waits for the end of the call
    answers: dict[int, int] = {}
    for number in range(MESSAGE_COUNT):
        add.call({"a": number, "b": 2**40}, lambda each: answers.update({each["sum"] - 2**40: each["sum"]}))
        if number >= OPEN_CALLS:
            poll_until(node, partial(answers.__contains__, number - OPEN_CALLS), 30)
    poll_until(node, lambda: len(answers) == MESSAGE_COUNT, 60)
    assert answers == {number: number + 2**40 for number in range(MESSAGE_COUNT)}
    add.close()


@pytest.fixture(scope="module")
def count(node: Node, peer: str) -> Iterator[ActionClient]:
    with ActionClient(node, "/fibonacci", FIBONACCI) as client:
        poll_until(node, lambda: client.has_server)
        poll_until(node, lambda: not node.poll(0.5))
        yield client


def wait_for_end(node: Node, sent: SentGoal) -> SentGoal:
    poll_until(node, lambda: sent.is_over)
    return sent


def test_accepted_goal_has_feedback_and_result(node: Node, count: ActionClient):
    end_s = time.monotonic() + 30
    feedback: object = None
    result = {"sequence": [0, 1, 1, 2, 3, 5, 8]}
    while (
        feedback != result and time.monotonic() < end_s
    ):  # ROS loses feedback until the server has found the client
        sent = wait_for_end(node, count.send({"order": 6}))
        assert sent.status is GoalStatus.SUCCEEDED
        assert sent.result == result
        feedback = sent.feedback
    assert feedback == result


def test_rejected_goal_has_no_result(node: Node, count: ActionClient, transport: str):
    if transport == REAL_ROSBRIDGE:
        pytest.skip("the real rosbridge does not answer rejected goals")
    sent = wait_for_end(node, count.send({"order": -1}))
    assert sent.is_accepted is False or sent.reason == "Action goal was rejected"
    assert not sent.result


def test_aborted_goal_has_result(node: Node, count: ActionClient):
    sent = wait_for_end(node, count.send({"order": ABORTED}))
    assert sent.status is GoalStatus.ABORTED
    assert sent.result is not None
    assert len(sent.result["sequence"]) == ABORTED + 1


def test_cancelled_goal_has_partial_result(node: Node, count: ActionClient):
    sent = count.send({"order": 1000})
    poll_until(node, lambda: sent.feedback)
    sent.cancel()
    wait_for_end(node, sent)
    assert sent.status is GoalStatus.CANCELED
    assert sent.result is not None
    assert 2 < len(sent.result["sequence"]) < 1000


@pytest.mark.parametrize("is_known", [False, True])
def test_goal_is_cancelled_right_after_send_or_acceptance(node: Node, count: ActionClient, is_known: bool):
    sent = count.send({"order": 1000})
    if is_known:
        poll_until(node, lambda: sent.is_accepted)
    sent.cancel()
    wait_for_end(node, sent)
    assert sent.status is GoalStatus.CANCELED


def test_cancel_of_ended_goal_is_refused(node: Node, count: ActionClient):
    if isinstance(node, RosbridgeNode):
        pytest.skip("a rosbridge reports nothing about goals that are over")
    sent = wait_for_end(node, count.send({"order": 2}))
    sent.cancel()
    poll_until(node, lambda: sent.cancel_refusal)
    assert sent.cancel_refusal in (CancelCode.GOAL_TERMINATED, CancelCode.REJECTED)


def test_parallel_goals_have_separate_results(node: Node, count: ActionClient):
    sent = [count.send({"order": number}) for number in range(1, 9)]
    for each in sent:
        wait_for_end(node, each)
    assert [len(each.result["sequence"]) for each in sent if each.result] == [2, *range(3, 10)]


@pytest.mark.parametrize("distribution", DISTRIBUTIONS)
def test_services_work_with_types_of_each_distribution(domain: int, distribution: str):
    types = Definitions([PACKAGES], distribution, environment={})
    with DdsNode("server", types, domain + 5) as node:
        node.serve("/sum", "example_interfaces/srv/AddTwoInts", lambda each: {"sum": each["a"] + each["b"]})
        client = node.create_client("/sum", "example_interfaces/srv/AddTwoInts")
        got: list[object] = []
        client.call({"a": 1, "b": 2}, got.append)
        poll_until(node, lambda: got)
        assert got == [{"sum": 3}]
        client.close()


def test_ended_subscription_does_not_wake_poll(node: Node):
    got: list[object] = []
    end = node.subscribe("/mine", "std_msgs/msg/String", got.append)
    publisher = node.create_publisher("/mine", "std_msgs/msg/String")
    publisher.publish({"data": "one"})
    poll_until(node, lambda: got)
    end()
    publisher.publish({"data": "two"})
    end_s, polls = time.monotonic() + 0.5, 0
    while time.monotonic() < end_s:
        node.poll(0.05)
        polls += 1
    assert (
        polls < 50
    )  # ten, and more for messages of further nodes; about a thousand if the subscription wakes each poll
    assert [each for each in got if each != {"data": "one"}] == []
    publisher.close()


def test_requests_and_messages_without_right_are_refused(node: Node, monkeypatch: pytest.MonkeyPatch):
    """An endpoint without a right needs the highest right, on all transports."""
    refused: list[str] = []
    monkeypatch.setattr(node, "rights", Rights(control=True, programs=False))
    monkeypatch.setattr(node, "complain", lambda _kind, text: refused.append(text))
    received: list[Any] = []

    def add(request: Any) -> dict[str, int]:
        received.append(request)
        return {"sum": request["a"] + request["b"]}

    kind = "example_interfaces/srv/AddTwoInts"
    ends = [
        node.serve("/open_service", kind, add, right=Right.CONTROL),
        node.serve("/forgotten_service", kind, add, make_refusal=lambda _request, _reason: {"sum": -1}),
        node.subscribe("/here", "std_msgs/msg/String", received.append, right=Right.CONTROL),
        node.subscribe("/here", "std_msgs/msg/String", received.append),
    ]
    for service, answer in (("/open_service", 3), ("/forgotten_service", -1)):
        client = node.create_client(service, kind)
        got: list[Any] = []
        while not got:
            poll_until(node, lambda: client.has_server)  # noqa: B023 - the loop waits for the end of the call
            failed: list[str] = []  # a bridge refuses calls before it has found the service
            client.call({"a": 1, "b": 2}, got.append, failed.append)
            poll_until(node, lambda: got or failed)  # noqa: B023
        assert got[0] == {"sum": answer}
        client.close()
    assert [each for each in received if "a" not in each] == []
    received.clear()
    publisher = node.create_publisher("/here", "std_msgs/msg/String")
    poll_until(node, publisher.count_subscriptions)
    publisher.publish({"data": "one"})
    poll_until(node, lambda: received and any(text.startswith("refused: /here: ") for text in refused))
    assert received == [{"data": "one"}]
    assert any(text.startswith("refused: /forgotten_service: ") for text in refused)
    for end in ends:
        end()
    publisher.close()


@needs_ros
def test_rclpy_node_uses_our_endpoints(peer: str, transport: str):
    if transport != "dds":
        pytest.skip("only DDS reaches the peer")
    process = subprocess.run(
        make_ros_python_command(str(HERE / "with_rclpy/user.py"), str(MESSAGE_COUNT)),
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    results = json.loads(process.stdout)
    assert results["got"] == [f"message {number}" for number in range(MESSAGE_COUNT)]
    assert results["sums"] == list(range(1, MESSAGE_COUNT + 1))
    goals = results["goals"]
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
    assert "peer" in results["nodes"]
    types = results["types"] | results["of_peer"] | results["services_of_peer"]
    assert (
        types.items()
        >= {
            "/back": ["std_msgs/msg/String"],
            "/fibonacci/_action/feedback": [f"{FIBONACCI}_FeedbackMessage"],
            "/add": ["example_interfaces/srv/AddTwoInts"],
        }.items()
    )
    assert not process.stderr, f"{peer}: {process.stderr}"


def test_domain_is_closed_with_last_node(domain: int):
    nodes = [DdsNode(name, Definitions(environment={}), domain + 4) for name in ("first", "second")]
    for node in nodes:
        assert domain + 4 in _domains
        node.close()
        node.close()  # a second call has no effect
    assert domain + 4 not in _domains


def test_garbage_collection_of_node_closes_domain(domain: int):
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
def requester(domain: int) -> Iterator[DdsNode]:
    with DdsNode("asks", TYPES, domain + 7) as node:
        yield node


def test_response_waits_for_discovery_of_reader(server: DdsNode, requester: DdsNode):
    """DDS discovers the writer of a request and the reader of the response separately."""
    kind, codec, got = parse_type(ADD, "srv"), Codec(TYPES), list[bytes]()
    request, response = kind.derive("Request"), kind.derive("Response")
    qos, owner_data = PROFILES["services_default"], make_owner_data("clientid")
    server.serve("/late", ADD, lambda each: {"sum": each["a"] + each["b"]})
    writer = requester._open_writer("rq/lateRequest", request, qos, owner_data)
    introduction = _IntroductionCheck(writer)
    poll_until(server, lambda: introduction.filter_introduced(frozenset(writer.get_matched_subscriptions())))
    data = codec.encode(request, {"a": 1, "b": 2})
    write_data(writer, data[:4] + bytes(16) + data[4:])
    poll_until(server, lambda: server._servers[0]._unsent_responses)
    requester._open_reader("rr/lateReply", response, qos, lambda sample: got.append(sample.cdr), owner_data)
    poll_until(requester, lambda: server.poll() or got)
    poll_until(requester, lambda: got)
    assert codec.decode(response, got[0][:4] + got[0][20:]) == {"sum": 3}
    assert not server._servers[0]._unsent_responses


def test_closed_server_and_client_are_gone_and_silent(server: DdsNode, requester: DdsNode):
    replies: Replies = []
    end = server.serve_later("/ends", ADD, lambda _request, reply: replies.append(reply))
    client = requester.create_client("/ends", ADD)
    for _ in range(2):
        poll_until(requester, lambda: client.has_server)
        client.call({"a": 1}, lambda _message: None)
    poll_until(server, lambda: len(replies) == 2)
    end()
    end()
    replies[0]({"sum": 1})  # the ended server sends no response
    poll_until(requester, lambda: not client.has_server)
    client.close()
    assert not client.has_server
    client.close()
    server.close()
    replies[1]({"sum": 1})


def test_response_to_closed_client_is_dropped(server: DdsNode, requester: DdsNode):
    replies: Replies = []
    server.serve_later("/late", ADD, lambda _request, reply: replies.append(reply))
    client = requester.create_client("/late", ADD)
    poll_until(requester, lambda: client.has_server)
    client.call({"a": 1, "b": 2}, lambda _message: None)
    poll_until(server, lambda: replies)
    client.close()
    poll_until(server, lambda: not server._servers[0]._response_readers.update())
    replies[0]({"sum": 3})
    poll_until(server, lambda: not server._servers[0]._unsent_responses)


def test_endpoint_added_during_count_is_counted():
    """The wheel of Cyclone DDS fails if a reader appears between the requests for number and handles."""
    assert list_matched_handles(Mock(side_effect=[IndexError("invalid index"), [1, 2]])) == [1, 2]


def test_cancel_before_acceptance_is_repeated(server: DdsNode, requester: DdsNode):
    replies: Replies = []
    codes: list[int] = []

    def handle_cancel(_request: object) -> dict[str, Any]:
        codes.append(CancelCode.NONE if codes else CancelCode.UNKNOWN_GOAL_ID)
        return {"return_code": codes[-1]}

    polls = partial(requester.poll, 0.05), server.poll
    server.serve_later(
        "/slow/_action/send_goal", f"{FIBONACCI}_SendGoal", lambda _request, reply: replies.append(reply)
    )
    server.serve_later("/slow/_action/get_result", f"{FIBONACCI}_GetResult", lambda _request, _reply: None)
    server.serve("/slow/_action/cancel_goal", "action_msgs/srv/CancelGoal", handle_cancel)
    with ActionClient(requester, "/slow", FIBONACCI) as client:
        wait_until(lambda: client.has_server, *polls)
        sent = client.send({"order": 1})
        sent.cancel()
        wait_until(lambda: replies and sent.cancel_refusal, *polls)
        replies[0]({"accepted": True})
        wait_until(lambda: len(codes) > 1 and sent.cancel_refusal is None, *polls)
