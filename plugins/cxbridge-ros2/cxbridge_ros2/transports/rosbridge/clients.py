"""Clients of services and actions over rosbridge.

The bridge has operations for whole actions. :class:`RosbridgeAction` presents an action as the services and
topics that :class:`~cxbridge_ros2.actions.ActionClient` uses, as in each other transport.
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
from cxbridge_ros2.transports.rosbridge.messages import to_base_type

# ABORTED of action_msgs/msg/GoalStatus, the status of a result without a status
_ABORTED: Final = 6
_CANCEL_PERIOD_S: Final = 0.5  # time until a cancel request is repeated
_MAX_CANCEL_REQUESTS: Final = 20  # requests per goal, since a goal that the robot rejects has no result


class ServiceClient(Client):
    """A client of a service. Requests are sent one by one, since rosbridge_suite loses some concurrent calls.

    :param encode: converts a request to JSON.
    :param send: sends a request (its first argument), and later calls the second argument with the response,
        or the third argument with the reason for a failure.
    """

    def __init__(
        self,
        connection: RosbridgeConnection,
        encode: Callable[[Mapping[str, Any]], Any],
        send: Callable[[Any, MessageCallback, FailureCallback], None],
    ) -> None:
        super().__init__()
        self._connection, self._encode, self._send = connection, encode, send
        # by number, in the order of the calls: the request, and the callbacks for its end
        self._requests: dict[int, tuple[Any, MessageCallback, FailureCallback | None]] = {}
        self._active_number: int | None = None

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        """Send a request as soon as the earlier requests have ended."""
        encoded_request, number = self._encode(request), next(self._numbers)
        self._requests[number] = encoded_request, on_response, on_failure
        self._send_next()
        return number

    def forget(self, number: int) -> None:
        self._requests.pop(number, None)
        if number == self._active_number:  # the next request must not wait for a response that may not arrive
            self._active_number = None
            self._send_next()

    def _send_next(self) -> None:
        if self._active_number is not None or not self._requests:
            return
        number = self._active_number = next(iter(self._requests))
        request, on_response, on_failure = self._requests[number]

        def finish(callback: Callable[[Any], None] | None, response: Any) -> None:
            is_pending = number in self._requests
            self.forget(number)
            if is_pending and callback is not None:
                callback(response)

        self._send(request, partial(finish, on_response), partial(finish, on_failure))

    @property
    def server_numbers(self) -> frozenset[int]:
        """A single number, which changes with each reconnection; empty without a connection.

        The bridge does not report servers, so a connection counts as a server.
        """
        return (
            frozenset({self._connection.connection_count}) if self._connection.is_connected else frozenset()
        )

    def close(self) -> None:
        """Do nothing, since the bridge stores nothing for a client."""


class RosbridgeAction:
    """The client side of an action.

    :param defer: queues a function for the next poll of the node.
    :param send: sends a goal with its id, and returns whether there was a connection.
    :ivar type_name: the type of the action; its package and name are empty until a topic or a service reveals
        the type.
    """

    def __init__(
        self,
        name: str,
        connection: RosbridgeConnection,
        defer: Callable[[Callable[[], None]], None],
        send: Callable[[RosbridgeAction, str, Mapping[str, Any]], bool],
    ) -> None:
        self.name, self.type_name = name, TypeName("", "action", "")
        self._connection, self._defer, self._send = connection, defer, send
        # by topic; the callbacks of `status` are never called, since the bridge does not send the topic
        self._callbacks: dict[str, list[MessageCallback]] = {"feedback": [], "status": []}
        self._result_callbacks: dict[str, tuple[MessageCallback, FailureCallback | None]] = {}
        # the time of the next cancel request and the number of remaining requests, by the id of the goal
        self._cancel_schedule: dict[str, tuple[float, int]] = {}

    def subscribe(self, topic: str, callback: MessageCallback) -> Callable[[], None]:
        """Call ``callback`` for each message of a topic; return the function that unsubscribes.

        :param topic: ``feedback`` or ``status``.
        """
        callbacks = self._callbacks[topic]
        callbacks.append(callback)
        return lambda: callbacks.remove(callback) if callback in callbacks else None

    def send_goal(self, request: Mapping[str, Any], on_response: MessageCallback) -> None:
        """Send a goal, which counts as accepted if there is a connection.

        The bridge does not report the acceptance.
        """
        is_accepted = self._send(self, request["goal_id"]["uuid"].hex(), request["goal"])
        # deferred, since the action client does not expect the response before this call returns; the time
        # of the acceptance is unknown
        self._defer(lambda: on_response({"accepted": is_accepted, "stamp": {"sec": 0, "nanosec": 0}}))

    def get_result(
        self, request: Mapping[str, Any], on_response: MessageCallback, on_failure: FailureCallback | None
    ) -> None:
        """Call ``on_response`` with the result of a goal, or ``on_failure`` with a reason."""
        self._result_callbacks[request["goal_id"]["uuid"].hex()] = (on_response, on_failure)

    def cancel(self, goal_id: str, remaining_requests: int = _MAX_CANCEL_REQUESTS) -> None:
        """Request to cancel a goal, repeatedly until its result arrives.

        The server of rosbridge_suite 2.1 ignores a cancel request before the acceptance of the goal, and does
        not report the acceptance. Feedback does not prove the acceptance, since feedback can arrive earlier.

        :param remaining_requests: the limit of requests, this request included.
        """
        self._cancel_schedule[goal_id] = (time.monotonic() + _CANCEL_PERIOD_S, remaining_requests - 1)
        self._connection.send({"op": "cancel_action_goal", "id": goal_id, "action": self.name})

    def repeat_cancel_requests(self) -> None:
        """Repeat the cancel requests of goals that have no result yet."""
        now_s = time.monotonic()
        for goal_id, (due_s, remaining_requests) in list(self._cancel_schedule.items()):
            if goal_id not in self._result_callbacks or not remaining_requests:
                del self._cancel_schedule[goal_id]
            elif now_s >= due_s:
                self.cancel(goal_id, remaining_requests)

    def handle_operation(self, op: Operation, from_json: Callable[[TypeName, Any], Message]) -> None:
        """Handle feedback or a result from the bridge."""
        goal_id = str(op.get("id"))
        if op["op"] == "action_feedback":
            feedback = from_json(self.type_name.derive("Feedback"), op.get("values"))
            message = {"goal_id": {"uuid": _parse_uuid(goal_id)}, "feedback": feedback}
            for callback in list(self._callbacks["feedback"]):
                callback(message)
            return
        on_response, on_failure = self._result_callbacks.pop(goal_id, (None, None))
        if on_response is not None and op.get("result", True):
            result = from_json(self.type_name.derive("Result"), op.get("values"))
            on_response({"status": to_base_type("int8", op.get("status", _ABORTED)), "result": result})
        elif on_failure is not None:
            on_failure(str(op.get("values")))

    def fail_goals(self, reason: str) -> None:
        """End the goals that wait for results as failures, after the loss of the connection."""
        callbacks, self._result_callbacks = self._result_callbacks, {}
        for _, on_failure in callbacks.values():
            if on_failure is not None:
                on_failure(reason)


class ActionServiceClient(Client):
    """A client of one service of an action: ``send_goal``, ``get_result`` or ``cancel_goal``."""

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
        else:  # without a response, since the bridge does not send one to a cancel request
            self._action.cancel(request["goal_info"]["goal_id"]["uuid"].hex())
        return 0  # the request cannot be forgotten: the action client ignores results of unknown goals

    @property
    def server_numbers(self) -> frozenset[int]:
        # unlike in ServiceClient, the number stays: the loss of the connection has ended the goals already
        return frozenset({0}) if self._connection.is_connected else frozenset()

    def close(self) -> None:
        """Do nothing, since the bridge stores nothing for a client."""


def _parse_uuid(goal_id: str) -> bytes:
    try:
        return bytes.fromhex(goal_id)
    except ValueError:
        return b""  # other clients may use ids of another form; their goals are unknown here
