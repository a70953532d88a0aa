"""Parameters, lifecycle and log of a node of cxbridge and of a node of rclpy."""

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
from ros2_tests.conftest import HERE, make_ros_python_command, needs_ros, poll_until, run_module, run_peer


@pytest.fixture
def node(
    managed: str,
) -> Iterator[Node]:  # closes first: after a kill of the managed node, close takes a second
    with DdsNode("asks", Definitions(distribution="iron", environment={})) as node:
        yield node


@pytest.fixture(params=["ours", pytest.param("rclpy", marks=needs_ros)])
def managed(request: pytest.FixtureRequest, domain: int) -> Iterator[str]:
    with run_peer(request.param, "managed.py"):
        yield str(request.param)


def wait_for_answer(node: Node, request: Callable[[Callable[[Any], None]], object]) -> Any:
    """Send a request, and wait for the answer."""
    got: list[Any] = []
    request(got.append)
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


def test_client_gets_values_of_parameters(node: Node, parameters: ParameterClient):
    requested = ["speed", "names", "limits.low", "works"]
    result = wait_for_answer(node, lambda done: parameters.get(requested, done))
    assert result == {"speed": 1.5, "names": ["a", "b"], "limits.low": 3, "works": True}
    assert wait_for_answer(node, lambda done: parameters.get(["speed", "none"], done)) == {}


@pytest.mark.parametrize(("name", "value"), [("fixed", "no"), ("none", 1)])
def test_unsettable_parameters_are_refused_with_reason(node, parameters, name, value):
    (reason,) = wait_for_answer(node, lambda done: parameters.set({name: value}, done)).values()
    assert reason


@pytest.mark.parametrize(
    ("prefixes", "depth", "names"),
    [
        ((), 1, {"speed", "names", "works", "fixed"}),
        ((), 2, {"speed", "names", "works", "fixed", "limits.low"}),
        (("limits",), 0, {"limits.low", "limits.deep.high"}),
    ],
)
def test_names_are_limited_by_prefix_and_depth(node, parameters, prefixes, depth, names):
    result = wait_for_answer(node, lambda done: parameters.list(done, prefixes, depth))
    standard_names = {"use_sim_time", "start_type_description_service"}  # parameters of each node of ROS
    assert set(result) - standard_names == names


def test_client_leads_node_through_lifecycle(node: Node, lifecycle: LifecycleClient):
    def change(name: str) -> tuple[bool, LifecycleState]:
        succeeds = wait_for_answer(node, lambda done: lifecycle.change(name, done))
        return succeeds, wait_for_answer(node, lifecycle.state)

    transitions: list[tuple[str, str, str]] = []
    node.subscribe(
        "/managed/transition_event",
        "lifecycle_msgs/msg/TransitionEvent",
        lambda each: transitions.append(
            (each["start_state"]["label"], each["transition"]["label"], each["goal_state"]["label"])
        ),
    )
    assert wait_for_answer(node, lifecycle.state) is LifecycleState.UNCONFIGURED
    assert change(ACTIVATE) == (False, LifecycleState.UNCONFIGURED)
    assert change(CONFIGURE) == (True, LifecycleState.INACTIVE)
    assert change(ACTIVATE) == (False, LifecycleState.INACTIVE)
    assert change(ACTIVATE) == (True, LifecycleState.ACTIVE)
    assert change(DEACTIVATE) == (True, LifecycleState.INACTIVE)
    assert change(CLEANUP) == (
        False,
        LifecycleState.FINALIZED,
    )  # the callback raises, and the node has no error handler
    assert change(SHUTDOWN) == (False, LifecycleState.FINALIZED)
    poll_until(node, lambda: transitions and transitions[-1][2] == "finalized")
    assert [
        transition
        for transition in transitions
        if "configur" in transition[0] or "activating" in transition[0]
    ][-3:]


def call_service(node: Node, service: str, kind: str) -> Any:
    client = node.create_client(f"/managed/{service}", f"lifecycle_msgs/srv/{kind}")
    poll_until(node, lambda: client.has_server)
    return wait_for_answer(node, lambda done: client.call({}, done))


def test_transition_graph_equals_that_of_ros(node: Node, managed: str, lifecycle: LifecycleClient):
    response = call_service(node, "get_transition_graph", "GetAvailableTransitions")
    result = {
        (
            each["transition"]["id"],
            each["transition"]["label"],
            each["start_state"]["label"],
            each["goal_state"]["label"],
        )
        for each in response["available_transitions"]
    }
    assert len(result) == 7 + 6 * 3
    assert (1, "configure", "unconfigured", "configuring") in result
    assert (61, "transition_failure", "errorprocessing", "finalized") in result
    response = call_service(node, "get_available_states", "GetAvailableStates")
    assert {(each["id"], each["label"]) for each in response["available_states"]} == {
        (int(state), state.name.lower()) for state in LifecycleState
    }


@pytest.mark.parametrize(
    "value",
    [True, -3, 0.5, "äö", [], [True, False], [1, -2], [0.5], ["a", ""]],
)
def test_decoded_value_equals_encoded_value(value):
    assert decode_value(encode_value(value)) == value


@needs_ros
def test_rclpy_uses_our_parameters_and_lifecycle(domain: int):
    """The clients are those of `ros2 param` and `ros2 lifecycle`."""
    with run_module("ros2_tests.managed"):
        script = str(HERE / "with_rclpy/manager.py")
        process = subprocess.run(
            make_ros_python_command(script),
            capture_output=True,
            text=True,
            check=False,
            timeout=60,
            env=os.environ,
        )
    assert process.returncode == 0, process.stderr
    assert json.loads(process.stdout) == {
        "names": ["fixed", "limits.deep.high", "limits.low", "names", "speed", "works"],
        "types": [3, 9, 2],
        "described": [["speed", 3, True], ["fixed", 4, True]],
        "set": [False, False],
        "values": [1.5, "yes"],
        "atomically": False,
        "states": ["unconfigured", "inactive", "inactive", "active"],
        "log": "configured",
    }
