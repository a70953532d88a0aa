"""Actions over rosbridge, presented as the topics and services that ActionClient uses."""

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
_AGAIN_S: Final = 0.5  # seconds until a cancel request is repeated
_MOST_CANCELS: Final = 20  # limit of repetitions: a goal that the robot rejects is never answered


class RosbridgeAction:
    """An action of a robot.

    :param later: queues a function for the next poll of the node.
    :param send: sends a goal with its id, and returns whether there was a connection.
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
        # time of the next cancel request, and number of requests left, by goal
        self._cancels: dict[str, tuple[float, int]] = {}

    def listen(self, part: str, receive: Receive) -> Callable[[], None]:
        """Call ``receive`` for each ``feedback`` or ``status`` message; return the unsubscribe function."""
        listeners = self._listeners[part]
        listeners.append(receive)
        return lambda: listeners.remove(receive) if receive in listeners else None

    def send_goal(self, request: Mapping[str, Any], done: Receive) -> None:
        """Send a goal, which counts as accepted at once since the bridge does not report acceptance."""
        accepted = self._send(self, request["goal_id"]["uuid"].hex(), request["goal"])
        self._later(lambda: done({"accepted": accepted, "stamp": {"sec": 0, "nanosec": 0}}))

    def get_result(self, request: Mapping[str, Any], done: Receive, failed: Failed | None) -> None:
        """Call ``done`` with the result of a goal, or ``failed`` with a reason."""
        self._results[request["goal_id"]["uuid"].hex()] = (done, failed)

    def cancel(self, number: str, left: int = _MOST_CANCELS) -> None:
        """Request to cancel a goal, repeatedly until its result arrives.

        The server of rosbridge_suite 2.1 ignores a cancel request until it knows that the goal was accepted,
        which it does not report. Feedback can arrive earlier.

        :param left: the number of requests, this one included.
        """
        self._cancels[number] = (time.monotonic() + _AGAIN_S, left - 1)
        self._connection.send({"op": "cancel_action_goal", "id": number, "action": self.name})

    def cancel_again(self) -> None:
        """Repeat the cancel requests without effect so far."""
        now_s = time.monotonic()
        for number, (due_s, attempts_left) in list(self._cancels.items()):
            if number not in self._results or not attempts_left:
                del self._cancels[number]
            elif now_s >= due_s:
                self.cancel(number, attempts_left)

    def take(self, op: Operation, from_json: Callable[[TypeName, Any], Message]) -> None:
        """Handle feedback or a result from the bridge."""
        number = str(op.get("id"))
        if op["op"] == "action_feedback":
            feedback = from_json(self.type.derived("Feedback"), op.get("values"))
            message = {"goal_id": {"uuid": _uuid(number)}, "feedback": feedback}
            for receive in list(self._listeners["feedback"]):
                receive(message)
            return
        callbacks = self._results.pop(number, None)
        if callbacks is None:
            return
        done, failed = callbacks
        if op.get("result", True):
            result = from_json(self.type.derived("Result"), op.get("values"))
            done({"status": base_value("int8", op.get("status", _ABORTED)), "result": result})
        elif failed is not None:
            failed(str(op.get("values")))

    def fail_all(self) -> None:
        """Fail the goals that wait for results, after a lost connection."""
        results, self._results = self._results, {}
        for _, failed in results.values():
            if failed is not None:
                failed("the connection to the rosbridge was lost")


class ActionPartClient(Client):
    """A client of one of an action's three services."""

    def __init__(self, connection: RosbridgeConnection, action: RosbridgeAction, part: str) -> None:
        self._connection, self._action, self._part = connection, action, part

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        if self._part == "send_goal":
            self._action.send_goal(request, done)
        elif self._part == "get_result":
            self._action.get_result(request, done, failed)
        else:
            self._action.cancel(request["goal_info"]["goal_id"]["uuid"].hex())
        return 0

    def forget(self, number: int) -> None:
        """Do nothing: results of forgotten goals are ignored."""

    @property
    def servers(self) -> frozenset[int]:
        return frozenset({0}) if self._connection.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge stores nothing for a client."""


def _uuid(number: str) -> bytes:
    try:
        return bytes.fromhex(number)
    except ValueError:
        return b""
