"""Parameters, lifecycle and log of a node: ours and rclpy's, each asked by our clients."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Callable, Iterator
from typing import Any

import pytest

pytest.importorskip("cyclonedds", reason="the extra ros2 is not installed")

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, CONFIGURE, DEACTIVATE, SHUTDOWN, LifecycleState
from cxbridge_ros2.node import Node
from cxbridge_ros2.parameters import encode_value
from cxbridge_ros2.transports.dds import DdsNode
from ros2_tests.clients import LifecycleClient, ParameterClient, decode_value
from ros2_tests.conftest import HERE, forked, needs_ros, poll_until, started, with_ros


@pytest.fixture
def node(managed: str) -> Iterator[Node]:  # it leaves first: it waits for a second for who was killed
    with DdsNode("asks", Definitions(distribution="iron", environment={})) as node:
        yield node


@pytest.fixture(params=["ours", pytest.param("rclpy", marks=needs_ros)])
def managed(request: pytest.FixtureRequest, domain: int) -> Iterator[str]:
    with started(request.param, "managed.py"):
        yield str(request.param)


def answer(node: Node, ask: Callable[[Callable[[Any], None]], object]) -> Any:
    """Ask, and wait for the answer."""
    got: list[Any] = []
    ask(got.append)
    poll_until(node, lambda: got)
    return got[0]


@pytest.fixture
def parameters(node: Node, managed: str) -> ParameterClient:
    client = ParameterClient(node, "/managed")
    poll_until(node, lambda: client.has_server)
    return client


@pytest.fixture
def lifecycle(node: Node, managed: str) -> LifecycleClient:
    client = LifecycleClient(node, "/managed")
    poll_until(node, lambda: client.has_server)
    return client


def test_values(node: Node, parameters: ParameterClient):
    wanted = ["speed", "names", "limits.low", "works"]
    found = answer(node, lambda done: parameters.get(wanted, done))
    assert found == {"speed": 1.5, "names": ["a", "b"], "limits.low": 3, "works": True}
    assert answer(node, lambda done: parameters.get(["speed", "none"], done)) == {}


@pytest.mark.parametrize(("name", "value"), [("fixed", "no"), ("none", 1)])
def test_what_cannot_be_set_is_refused_with_a_reason(node, parameters, name, value):
    (reason,) = answer(node, lambda done: parameters.set({name: value}, done)).values()
    assert reason


@pytest.mark.parametrize(
    ("prefixes", "depth", "names"),
    [
        ((), 1, {"speed", "names", "works", "fixed"}),
        ((), 2, {"speed", "names", "works", "fixed", "limits.low"}),
        (("limits",), 0, {"limits.low", "limits.deep.high"}),
    ],
)
def test_names(node, parameters, prefixes, depth, names):
    found = answer(node, lambda done: parameters.list(done, prefixes, depth))
    own = {"use_sim_time", "start_type_description_service"}  # what nodes of ROS have by themselves
    assert set(found) - own == names


def test_a_node_is_led_through_its_life(node: Node, lifecycle: LifecycleClient):
    def change(name: str) -> tuple[bool, LifecycleState]:
        done = answer(node, lambda done: lifecycle.change(name, done))
        return done, answer(node, lifecycle.state)

    moves: list[tuple[str, str, str]] = []
    node.subscribe(
        "/managed/transition_event",
        "lifecycle_msgs/msg/TransitionEvent",
        lambda each: moves.append(
            (each["start_state"]["label"], each["transition"]["label"], each["goal_state"]["label"])
        ),
    )
    assert answer(node, lifecycle.state) is LifecycleState.UNCONFIGURED
    assert change(ACTIVATE) == (False, LifecycleState.UNCONFIGURED)
    assert change(CONFIGURE) == (True, LifecycleState.INACTIVE)
    assert change(ACTIVATE) == (False, LifecycleState.INACTIVE)
    assert change(ACTIVATE) == (True, LifecycleState.ACTIVE)
    assert change(DEACTIVATE) == (True, LifecycleState.INACTIVE)
    assert change(CLEANUP) == (False, LifecycleState.FINALIZED)  # its work raises, and nothing handles that
    assert change(SHUTDOWN) == (False, LifecycleState.FINALIZED)
    poll_until(node, lambda: moves and moves[-1][2] == "finalized")
    assert [move for move in moves if "configur" in move[0] or "activating" in move[0]][-3:]


def call(node: Node, service: str, kind: str) -> Any:
    client = node.create_client(f"/managed/{service}", f"lifecycle_msgs/srv/{kind}")
    poll_until(node, lambda: client.has_server)
    return answer(node, lambda done: client.call({}, done))


def test_the_graph_of_transitions_is_that_of_ros(node: Node, managed: str, lifecycle: LifecycleClient):
    response = call(node, "get_transition_graph", "GetAvailableTransitions")
    found = {
        (
            each["transition"]["id"],
            each["transition"]["label"],
            each["start_state"]["label"],
            each["goal_state"]["label"],
        )
        for each in response["available_transitions"]
    }
    assert len(found) == 7 + 6 * 3
    assert (1, "configure", "unconfigured", "configuring") in found
    assert (61, "transition_failure", "errorprocessing", "finalized") in found
    response = call(node, "get_available_states", "GetAvailableStates")
    assert {(each["id"], each["label"]) for each in response["available_states"]} == {
        (int(state), state.name.lower()) for state in LifecycleState
    }


@pytest.mark.parametrize(
    "value",
    [True, -3, 0.5, "äö", [], [True, False], [1, -2], [0.5], ["a", ""]],
)
def test_a_value_comes_back_as_it_was(value):
    assert decode_value(encode_value(value)) == value


@needs_ros
def test_rclpy_asks_our_node(domain: int):
    """With rclpy's own clients: what `ros2 param` and `ros2 lifecycle` are made of."""
    with forked("ros2_tests.managed"):
        script = str(HERE / "with_rclpy/manager.py")
        done = subprocess.run(
            with_ros(script), capture_output=True, text=True, check=False, timeout=60, env=os.environ
        )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout) == {
        "names": ["fixed", "limits.deep.high", "limits.low", "names", "speed", "works"],
        "types": [3, 9, 2],
        "described": [["speed", 3, True], ["fixed", 4, True]],
        "set": [False, False],
        "values": [1.5, "yes"],
        "atomically": False,
        "states": ["unconfigured", "inactive", "inactive", "active"],
        "log": "configured",
    }
