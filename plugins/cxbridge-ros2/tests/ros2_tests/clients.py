"""Clients of the parameters and the lifecycle of nodes, whose responses arrive during polls."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from cxbridge.closing import Closing
from cxbridge.events import LogLine
from cxbridge_ros2.lifecycle import ACTIVATE, CLEANUP, CONFIGURE, DEACTIVATE, SHUTDOWN, LifecycleState
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Client, Node
from cxbridge_ros2.parameters import ParameterValue, encode_value
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.rosout import LOG_TYPE, ROSOUT_TOPIC, find_level
from cxbridge_ros2.stamps import stamp_to_us

SCALARS = ("", "bool_value", "integer_value", "double_value", "string_value", "byte_array_value")
ARRAYS = ("bool_array_value", "integer_array_value", "double_array_value", "string_array_value")
VALUE_FIELDS = (*SCALARS, *ARRAYS)
"""The field of a value, by the number of its type."""


def decode_value(message: Message) -> Any:
    """Return the value in an rcl_interfaces/msg/ParameterValue."""
    return message[VALUE_FIELDS[message["type"]]]


def subscribe_log(node: Node, on_line: Callable[[LogLine], None]) -> None:
    """Call a function for each line on /rosout."""

    def receive(message: Message) -> None:
        stamp, level = stamp_to_us(message["stamp"]), find_level(message["level"])
        on_line(LogLine(stamp, level, message["name"], message["msg"]))

    node.subscribe(ROSOUT_TOPIC, LOG_TYPE, receive, PROFILES["rosout"])


class LifecycleClient(Closing):
    """A client of the lifecycle of a managed node. Responses arrive while the client's node is polled.

    :param target: the managed node, e.g. ``/robot1/controller``.
    """

    def __init__(self, node: Node, target: str) -> None:
        self._change = node.create_client(f"{target}/change_state", "lifecycle_msgs/srv/ChangeState")
        self._state = node.create_client(f"{target}/get_state", "lifecycle_msgs/srv/GetState")

    @property
    def has_server(self) -> bool:
        """Whether the managed node runs."""
        return self._change.has_server and self._state.has_server

    def state(self, done: Callable[[LifecycleState], None]) -> None:
        """Request the state, and pass the state to ``done``."""

        def receive(response: Message) -> None:
            state_id = response["current_state"]["id"]
            done(LifecycleState(state_id) if state_id in list(LifecycleState) else LifecycleState.UNKNOWN)

        self._state.call({}, receive)

    def change(self, name: str, done: Callable[[bool], None]) -> None:
        """Request a transition, e.g. :data:`ACTIVATE`, and pass its success to ``done``."""
        names = (CONFIGURE, CLEANUP, ACTIVATE, DEACTIVATE, SHUTDOWN)
        transition = {"id": names.index(name) + 1 if name in names else 0, "label": name}
        self._change.call({"transition": transition}, lambda response: done(bool(response["success"])))

    def close(self) -> None:
        """Close the clients of the services."""
        self._change.close()
        self._state.close()


class ParameterClient(Closing):
    """A client of the parameters of a node. Responses arrive while the client's node is polled.

    :param target: the node with the parameters, e.g. ``/robot1/controller``.
    """

    def __init__(self, node: Node, target: str) -> None:
        def client(service: str) -> Client:
            kind = "".join(word.capitalize() for word in service.split("_"))
            return node.create_client(f"{target}/{service}", f"rcl_interfaces/srv/{kind}")

        self._get, self._set, self._list = map(
            client, ("get_parameters", "set_parameters", "list_parameters")
        )

    @property
    def has_server(self) -> bool:
        """Whether all services have a server."""
        return all(each.has_server for each in (self._get, self._set, self._list))

    def get(self, names: Sequence[str], done: Callable[[Mapping[str, ParameterValue]], None]) -> None:
        """Request values, and pass them by name to ``done``: no value if any name is unknown."""

        def receive(response: Message) -> None:
            done(dict(zip(names, map(decode_value, response["values"]), strict=False)))

        self._get.call({"names": list(names)}, receive)

    def set(self, values: Mapping[str, ParameterValue], done: Callable[[Mapping[str, str]], None]) -> None:
        """Set values in sequence, and pass the reasons of refusals to ``done``: empty for set values."""
        parameters = [{"name": name, "value": encode_value(value)} for name, value in values.items()]

        def receive(response: Message) -> None:
            reasons = [
                "" if each["successful"] else each["reason"] or "refused" for each in response["results"]
            ]
            done(dict(zip(values, reasons, strict=False)))

        self._set.call({"parameters": parameters}, receive)

    def list(
        self, done: Callable[[Sequence[str]], None], prefixes: Sequence[str] = (), depth: int = 0
    ) -> None:
        """Request names, and pass them to ``done``.

        :param prefixes: parents of the names, e.g. ``planner`` of ``planner.timeout``; empty: all.
        :param depth: the maximum depth of names; 0: no maximum.
        """

        def receive(response: Message) -> None:
            done(list(response["result"]["names"]))

        self._list.call({"prefixes": list(prefixes), "depth": depth}, receive)

    def close(self) -> None:
        """Close the clients of the services."""
        for each in (self._get, self._set, self._list):
            each.close()
