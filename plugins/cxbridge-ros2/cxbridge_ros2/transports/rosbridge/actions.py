"""Actions over rosbridge: calls of the server's own, as the topics and services that ActionClient knows."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from typing import Any, Final

from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import TypeName
from cxbridge_ros2.node import Client, Failed, Receive
from cxbridge_ros2.transports.rosbridge.connection import Operation, RosbridgeConnection
from cxbridge_ros2.transports.rosbridge.messages import base_value

_ABORTED: Final = 6  # of action_msgs/msg/GoalStatus
_AGAIN_S: Final = 0.5
"""Seconds after which a cancel is sent again."""
_MOST_CANCELS: Final = 20
"""So often at most: a goal that the robot rejects is never answered."""


class RosbridgeAction:
    """An action of a robot, as the parts that ActionClient knows.

    :param connection: to the bridge.
    :param later: takes functions that the next poll of the node calls.
    :param send: sends a goal with its id; returns whether there was a connection.
    """

    def __init__(
        self,
        name: str,
        connection: RosbridgeConnection,
        later: Callable[[Callable[[], None]], None],
        send: Callable[[RosbridgeAction, str, Mapping[str, Any]], bool],
    ) -> None:
        self.name, self.type = name, TypeName("", "action", "")
        self._connection, self._later, self._send = connection, later, send
        self._listeners: dict[str, list[Receive]] = {"feedback": [], "status": []}
        self._results: dict[str, tuple[Receive, Failed | None]] = {}
        self._cancels: dict[str, tuple[float, int]] = {}  # when to send each again, and how often, by goal

    def listen(self, part: str, receive: Receive) -> Callable[[], None]:
        """Call ``receive`` for each message of ``feedback`` or ``status``; return what ends that."""
        listeners = self._listeners[part]
        listeners.append(receive)
        return lambda: listeners.remove(receive) if receive in listeners else None

    def send_goal(self, request: Mapping[str, Any], done: Receive) -> None:
        """Send a goal. The bridge does not report whether it is accepted: it is taken for that at once."""
        accepted = self._send(self, request["goal_id"]["uuid"].hex(), request["goal"])
        self._later(lambda: done({"accepted": accepted, "stamp": {"sec": 0, "nanosec": 0}}))

    def get_result(self, request: Mapping[str, Any], done: Receive, failed: Failed | None) -> None:
        """Call ``done`` with the result of a goal, or ``failed`` with a reason."""
        self._results[request["goal_id"]["uuid"].hex()] = (done, failed)

    def cancel(self, number: str, left: int = _MOST_CANCELS) -> None:
        """Ask the bridge to cancel a goal, until its result comes.

        The server of rosbridge_suite 2.1 ignores a cancel until it knows that the goal was accepted, which it
        does not report. Feedback can come before.

        :param left: how often it may be sent, this time included.
        """
        self._cancels[number] = (time.monotonic() + _AGAIN_S, left - 1)
        self._connection.send({"op": "cancel_action_goal", "id": number, "action": self.name})

    def cancel_again(self) -> None:
        """Send the cancels again that had no effect yet."""
        now_s = time.monotonic()
        for number, (due_s, left) in list(self._cancels.items()):
            if number not in self._results or not left:
                del self._cancels[number]
            elif now_s >= due_s:
                self.cancel(number, left)

    def take(self, op: Operation, from_json: Callable[[TypeName, Any], Message]) -> None:
        """Take feedback or a result from the bridge."""
        number = str(op.get("id"))
        if op["op"] == "action_feedback":
            feedback = from_json(self.type.derived("Feedback"), op.get("values"))
            message = {"goal_id": {"uuid": _uuid(number)}, "feedback": feedback}
            for receive in list(self._listeners["feedback"]):
                receive(message)
            return
        found = self._results.pop(number, None)
        if found is None:
            return
        done, failed = found
        if op.get("result", True):
            result = from_json(self.type.derived("Result"), op.get("values"))
            done({"status": base_value("int8", op.get("status", _ABORTED)), "result": result})
        elif failed is not None:
            failed(str(op.get("values")))

    def fail_all(self) -> None:
        """Fail the goals that wait for their results: the connection was lost."""
        results, self._results = self._results, {}
        for _, failed in results.values():
            if failed is not None:
                failed("the connection to the rosbridge was lost")


class ActionPartClient(Client):
    """One of the three services of an action."""

    def __init__(self, connection: RosbridgeConnection, action: RosbridgeAction, part: str) -> None:
        self._connection, self._action, self._part = connection, action, part

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        """Send a request; see the base class."""
        if self._part == "send_goal":
            self._action.send_goal(request, done)
        elif self._part == "get_result":
            self._action.get_result(request, done, failed)
        else:
            self._action.cancel(request["goal_info"]["goal_id"]["uuid"].hex())
        return 0

    def forget(self, number: int) -> None:
        """Do nothing: a goal that is forgotten is reported no more."""

    @property
    def servers(self) -> frozenset[int]:
        """As for services."""
        return frozenset({0}) if self._connection.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge keeps nothing for a client."""


def _uuid(number: str) -> bytes:
    try:
        return bytes.fromhex(number)
    except ValueError:
        return b""
