"""Clients of services and actions over rosbridge.

The bridge has an operation for a whole action. Here an action is presented as the topics and services that
:class:`~cxbridge_ros2.actions.ActionClient` uses, as every other transport has them.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import TypeName
from cxbridge_ros2.node import Client, FailureCallback, MessageCallback
from cxbridge_ros2.transports.rosbridge.connection import Operation, RosbridgeConnection
from cxbridge_ros2.transports.rosbridge.messages import base_value

_ABORTED: Final = 6  # a value of action_msgs/msg/GoalStatus
_CANCEL_PERIOD_S: Final = 0.5  # seconds until a cancel request is repeated
_MAX_CANCELS: Final = 20  # limit of repetitions: a goal that the robot rejects has no result


class ServiceClient(Client):
    """A client that calls one request after the other: rosbridge_suite loses some concurrent calls.

    :param encode: converts a request to JSON.
    :param send: sends a request and calls one of both functions with the result.
    """

    def __init__(
        self,
        connection: RosbridgeConnection,
        encode: Callable[[Mapping[str, Any]], Any],
        send: Callable[[Any, MessageCallback, FailureCallback], None],
    ) -> None:
        super().__init__()
        self._connection, self._encode, self._send = connection, encode, send
        self._requests: dict[int, Any] = {}
        self._active_number: int | None = None

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        """Send a request after the earlier ones have ended."""
        encoded = self._encode(request)
        number = self._register_request(on_response, on_failure)
        self._requests[number] = encoded
        self._send_next()
        return number

    def forget(self, number: int) -> None:
        super().forget(number)
        self._requests.pop(number, None)
        if number == self._active_number:  # its response may never arrive
            self._active_number = None
            self._send_next()

    def _send_next(self) -> None:
        if self._active_number is not None or not self._requests:
            return
        number = self._active_number = next(iter(self._requests))
        on_response, on_failure = self._pending_callbacks[number]

        def finish(callback: Callable[[Any], None] | None, response: Any) -> None:
            is_pending = number in self._pending_callbacks
            self.forget(number)
            if is_pending and callback is not None:
                callback(response)

        self._send(self._requests[number], partial(finish, on_response), partial(finish, on_failure))

    @property
    def server_numbers(self) -> frozenset[int]:
        """A number that changes with each reconnection."""
        return frozenset({self._connection.connections}) if self._connection.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge stores nothing for a client."""


class RosbridgeAction:
    """An action of a robot.

    :param defer: queues a function for the next poll of the node.
    :param send: sends a goal with its id, and returns whether there was a connection.
    """

    def __init__(
        self,
        name: str,
        connection: RosbridgeConnection,
        defer: Callable[[Callable[[], None]], None],
        send: Callable[[RosbridgeAction, str, Mapping[str, Any]], bool],
    ) -> None:
        self.name, self.type = name, TypeName("", "action", "")
        self._connection, self._defer, self._send = connection, defer, send
        self._callbacks: dict[str, list[MessageCallback]] = {"feedback": [], "status": []}
        self._results: dict[str, tuple[MessageCallback, FailureCallback | None]] = {}
        # time of the next cancel request, and number of requests to go, by goal
        self._cancels: dict[str, tuple[float, int]] = {}

    def subscribe(self, topic: str, callback: MessageCallback) -> Callable[[], None]:
        """Call ``callback`` for each message of a topic; return the function that unsubscribes.

        :param topic: ``feedback`` or ``status``.
        """
        callbacks = self._callbacks[topic]
        callbacks.append(callback)
        return lambda: callbacks.remove(callback) if callback in callbacks else None

    def send_goal(self, request: Mapping[str, Any], on_response: MessageCallback) -> None:
        """Send a goal, which counts as accepted at once since the bridge does not report acceptance."""
        accepted = self._send(self, request["goal_id"]["uuid"].hex(), request["goal"])
        # deferred: an action client stores the goal before its response
        self._defer(lambda: on_response({"accepted": accepted, "stamp": {"sec": 0, "nanosec": 0}}))

    def get_result(
        self, request: Mapping[str, Any], on_response: MessageCallback, on_failure: FailureCallback | None
    ) -> None:
        """Call ``done`` with the result of a goal, or ``failed`` with a reason."""
        self._results[request["goal_id"]["uuid"].hex()] = (on_response, on_failure)

    def cancel(self, goal_id: str, requests: int = _MAX_CANCELS) -> None:
        """Request to cancel a goal, repeatedly until its result arrives.

        The server of rosbridge_suite 2.1 ignores a cancel request until it knows that the goal was accepted,
        which it does not report. Feedback can arrive earlier.

        :param requests: the number of requests, this one included.
        """
        self._cancels[goal_id] = (time.monotonic() + _CANCEL_PERIOD_S, requests - 1)
        self._connection.send({"op": "cancel_action_goal", "id": goal_id, "action": self.name})

    def cancel_again(self) -> None:
        """Repeat the cancel requests without effect so far."""
        now_s = time.monotonic()
        for goal_id, (due_s, requests) in list(self._cancels.items()):
            if goal_id not in self._results or not requests:
                del self._cancels[goal_id]
            elif now_s >= due_s:
                self.cancel(goal_id, requests)

    def handle(self, op: Operation, from_json: Callable[[TypeName, Any], Message]) -> None:
        """Handle feedback or a result from the bridge."""
        goal_id = str(op.get("id"))
        if op["op"] == "action_feedback":
            feedback = from_json(self.type.derive("Feedback"), op.get("values"))
            message = {"goal_id": {"uuid": _uuid(goal_id)}, "feedback": feedback}
            for callback in list(self._callbacks["feedback"]):
                callback(message)
            return
        on_response, on_failure = self._results.pop(goal_id, (None, None))
        if on_response is not None and op.get("result", True):
            result = from_json(self.type.derive("Result"), op.get("values"))
            on_response({"status": base_value("int8", op.get("status", _ABORTED)), "result": result})
        elif on_failure is not None:
            on_failure(str(op.get("values")))

    def fail_all(self, reason: str) -> None:
        """Fail the goals that wait for results, after a lost connection."""
        results, self._results = self._results, {}
        for _, on_failure in results.values():
            if on_failure is not None:
                on_failure(reason)


class ActionServiceClient(Client):
    """A client of a service of an action: ``send_goal``, ``get_result`` or ``cancel_goal``."""

    def __init__(self, connection: RosbridgeConnection, action: RosbridgeAction, service: str) -> None:
        super().__init__()
        self._connection, self._action, self._service = connection, action, service

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        if self._service == "send_goal":
            self._action.send_goal(request, on_response)
        elif self._service == "get_result":
            self._action.get_result(request, on_response, on_failure)
        else:  # the bridge does not answer a cancel request
            self._action.cancel(request["goal_info"]["goal_id"]["uuid"].hex())
        return 0

    @property
    def server_numbers(self) -> frozenset[int]:
        return frozenset({0}) if self._connection.is_up else frozenset()

    def close(self) -> None:
        """Do nothing: the bridge stores nothing for a client."""


def _uuid(goal_id: str) -> bytes:
    try:
        return bytes.fromhex(goal_id)
    except ValueError:
        return b""  # the feedback of another client, whose ids have another form
