"""Clients and servers of ROS 2 actions, made from the services and topics of a node.

A client sends a goal (service ``send_goal``). When the server has accepted the goal, the client requests the
result (``get_result``, which the server answers at the end). The client may also cancel the goal
(``cancel_goal``). The topics ``feedback`` and ``status`` report the progress in between.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Generator, Mapping
from enum import IntEnum
from functools import partial
from typing import Any, Final

from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.rights import Right, right_of_frame
from cxbridge_ros2.builtin_definitions import CANCEL_GOAL_TYPE
from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Client, Node, SendResponse
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import stamp_to_ns, us_to_stamp

STATUS_TYPE: Final = "action_msgs/msg/GoalStatusArray"

_MAX_RESULTS: Final = 100  # limit of the results that a server keeps for late requests


class GoalStatus(IntEnum):
    """The states of a goal: action_msgs/msg/GoalStatus."""

    UNKNOWN = 0
    ACCEPTED = 1
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6

    @classmethod
    def _missing_(cls, value: object) -> GoalStatus:  # noqa: ARG003 - a peer may send any number
        return cls.UNKNOWN

    @property
    def is_final(self) -> bool:
        return self >= GoalStatus.SUCCEEDED


class CancelCode(IntEnum):
    """The response to a cancel request: action_msgs/srv/CancelGoal."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL_ID = 2
    GOAL_TERMINATED = 3

    @classmethod
    def _missing_(cls, value: object) -> CancelCode:  # noqa: ARG003 - a peer may send any number
        return cls.REJECTED


class GoalObserver:
    """Callbacks for the events of a sent goal, in the order of the events. The defaults do nothing."""

    def on_response(self, sent_goal: SentGoal) -> None:
        """Handle the acceptance or rejection of the goal."""

    def on_feedback(self, sent_goal: SentGoal, feedback: Message) -> None:
        """Handle feedback about the goal."""

    def on_end(self, sent_goal: SentGoal) -> None:
        """Handle the end of the goal, whose result is set."""

    def on_cancel_response(self, sent_goal: SentGoal, response: Message) -> None:
        """Handle the response to a cancel request."""


class SentGoal:
    """A goal that was sent to a server. Polling the node updates the attributes.

    :ivar is_accepted: None before the server's response.
    :ivar accepted_s: the time of the acceptance, in seconds since the epoch; 0.0 before the acceptance.
    :ivar status: the last known status.
    :ivar feedback: the last feedback, or None.
    :ivar result: the result message; empty if the goal ended without a result; None before the end, and for a
        rejected goal.
    :ivar reason: why the result is missing, if the transport knows; else empty.
    :ivar is_cancel_requested: whether a cancel request was sent.
    :ivar cancel_refusal: the reason why the last cancel request was refused, or None.
    :ivar server_numbers: the numbers of all servers that were present at the sending or at a later check.
    """

    def __init__(self, client: ActionClient, goal_id: bytes, observer: GoalObserver) -> None:
        self._client = client
        self.goal_id = goal_id
        self.observer = observer
        self.is_accepted: bool | None = None
        self.accepted_s = 0.0
        self.status = GoalStatus.UNKNOWN
        self.feedback: Message | None = None
        self.result: Message | None = None
        self.reason = ""
        self.cancel_refusal: CancelCode | None = None
        self.is_cancel_requested = False
        self.server_numbers: frozenset[int] = frozenset()

    @property
    def is_over(self) -> bool:
        """Whether the goal was rejected or has a result."""
        return self.is_accepted is False or self.result is not None

    def cancel(self) -> None:
        self._client.cancel(self)


class ActionClient(Closing):
    """Client of an action.

    :param name: the name of the action, such as ``/navigate_to_pose``.
    :param action_type: the type of the action, such as ``nav2_msgs/action/NavigateToPose``.
    :raises Ros2Error: if the name or type is invalid.
    """

    def __init__(self, node: Node, name: str, action_type: str) -> None:
        type_name = parse_type(action_type, "action")
        self._goals: dict[bytes, SentGoal] = {}
        self._goal_client = node.create_client(f"{name}/_action/send_goal", str(type_name.derive("SendGoal")))
        self._result_client = node.create_client(
            f"{name}/_action/get_result", str(type_name.derive("GetResult"))
        )
        self._cancel_client = node.create_client(f"{name}/_action/cancel_goal", CANCEL_GOAL_TYPE)
        self._unsubscribe_functions = [
            node.subscribe(
                f"{name}/_action/feedback",
                str(type_name.derive("FeedbackMessage")),
                self._receive_feedback,
                right=Right.LOOK,  # events of this client's goals require no other right
            ),
            node.subscribe(
                f"{name}/_action/status",
                STATUS_TYPE,
                self._receive_status,
                PROFILES["action_status"],
                right=Right.LOOK,
            ),
        ]

    @property
    def has_server(self) -> bool:
        return all(client.has_server for client in self._clients)

    def explain_missing_server(self) -> str:
        """Return why the action has no server; empty if the transport does not know."""
        return self._goal_client.explain_missing_server()

    @property
    def _clients(self) -> tuple[Client, ...]:
        return self._goal_client, self._result_client, self._cancel_client

    def send(self, goal: Mapping[str, Any], observer: GoalObserver | None = None) -> SentGoal:
        """Send a goal.

        :param observer: handles the events of the goal.
        :raises Ros2Error: if the goal does not have the type of the action.
        """
        goal_id = uuid.uuid4().bytes
        sent_goal = SentGoal(self, goal_id, observer or GoalObserver())
        sent_goal.server_numbers = self._result_client.server_numbers

        def handle_response(response: Message) -> None:
            sent_goal.is_accepted = bool(response["accepted"])
            if not sent_goal.is_accepted:
                self._goals.pop(goal_id, None)
                sent_goal.observer.on_response(sent_goal)
                return
            sent_goal.accepted_s = stamp_to_ns(response["stamp"]) / 1e9
            # the status topic may have reported a later status already
            sent_goal.status = max(sent_goal.status, GoalStatus.ACCEPTED)
            sent_goal.observer.on_response(sent_goal)
            self._request_result(sent_goal)
            # an earlier cancel request may have been refused for an unknown goal
            if sent_goal.is_cancel_requested:
                self.cancel(sent_goal)

        self._goal_client.call(
            {"goal_id": {"uuid": goal_id}, "goal": goal},
            handle_response,
            partial(self._end_goal, sent_goal, GoalStatus.ABORTED, {}),
        )
        self._goals[goal_id] = sent_goal  # messages about the goal are received by later polls
        return sent_goal

    def check_server(self, sent_goal: SentGoal) -> None:
        """End the goal with the status UNKNOWN if the server of the goal was restarted or replaced."""
        present_servers = self._result_client.server_numbers
        if present_servers - sent_goal.server_numbers and sent_goal.is_accepted:
            # a new server that replaces the server of the goal responds with the status UNKNOWN
            self._request_result(sent_goal)
        elif (
            present_servers
            and sent_goal.server_numbers.isdisjoint(present_servers)
            and sent_goal.is_accepted is None
        ):
            # all servers that could have accepted the goal are gone
            self._end_goal(sent_goal, GoalStatus.UNKNOWN, {})
        sent_goal.server_numbers |= present_servers

    def _end_goal(self, sent_goal: SentGoal, status: GoalStatus, result: Message, reason: str = "") -> None:
        """End a goal, unless the goal has ended already.

        :param result: the result message; empty if there is none.
        :param reason: why there is no result; may be empty.
        """
        if self._goals.pop(sent_goal.goal_id, None) is not None:
            sent_goal.status, sent_goal.result, sent_goal.reason = status, result, reason
            sent_goal.observer.on_end(sent_goal)

    def _request_result(self, sent_goal: SentGoal) -> None:
        """Request the result of a goal; the server responds when the goal has ended."""
        self._result_client.call(
            {"goal_id": {"uuid": sent_goal.goal_id}},
            lambda response: self._end_goal(sent_goal, GoalStatus(response["status"]), response["result"]),
            partial(self._end_goal, sent_goal, GoalStatus.ABORTED, {}),
        )

    def cancel(self, sent_goal: SentGoal) -> None:
        """Send a cancel request. If the goal is not accepted yet, repeat the request after the acceptance."""
        sent_goal.is_cancel_requested = True

        def handle_response(response: Message) -> None:
            code = CancelCode(response["return_code"])
            sent_goal.cancel_refusal = None if code == CancelCode.NONE else code
            sent_goal.observer.on_cancel_response(sent_goal, response)

        self._cancel_client.call({"goal_info": {"goal_id": {"uuid": sent_goal.goal_id}}}, handle_response)

    def cancel_goals_until(self, accepted_s: float, on_response: Callable[[Message], None]) -> None:
        """Request to cancel the goals of all clients that were accepted until a time.

        :param accepted_s: the time in seconds since the epoch; 0.0 means all goals.
        :param on_response: called with the response.
        """
        sec, nanosec = divmod(round(accepted_s * 1e9), 10**9)
        self._cancel_client.call({"goal_info": {"stamp": {"sec": sec, "nanosec": nanosec}}}, on_response)

    def forget(self, sent_goal: SentGoal) -> None:
        """Stop waiting for a goal whose server is gone."""
        self._goals.pop(sent_goal.goal_id, None)

    def close(self) -> None:
        for close_endpoint in (*(client.close for client in self._clients), *self._unsubscribe_functions):
            close_endpoint()

    def _receive_feedback(self, message: Message) -> None:
        sent_goal = self._goals.get(message["goal_id"]["uuid"])
        if sent_goal is not None:
            sent_goal.feedback = message["feedback"]
            sent_goal.observer.on_feedback(sent_goal, message["feedback"])

    def _receive_status(self, message: Message) -> None:
        for goal_status in message["status_list"]:
            sent_goal = self._goals.get(goal_status["goal_info"]["goal_id"]["uuid"])
            if sent_goal is not None and not sent_goal.status.is_final:
                sent_goal.status = GoalStatus(goal_status["status"])


class GoalResponse(IntEnum):
    """The server's decision about a new goal, with the names of rclcpp."""

    REJECT = 1
    ACCEPT_AND_EXECUTE = 2
    ACCEPT_AND_DEFER = 3


class ServedGoal:
    """A goal at the server.

    :ivar is_cancel_requested: whether a client has requested to cancel the goal.
    """

    def __init__(self, server: GoalServer, goal_id: bytes, goal: Message, stamp: Message) -> None:
        self._server = server
        self.goal_id = goal_id
        self.goal = goal
        self.stamp = stamp
        self.status = GoalStatus.ACCEPTED
        self.is_cancel_requested = False

    @property
    def info(self) -> Message:
        """The goal's action_msgs/msg/GoalInfo."""
        return {"goal_id": {"uuid": self.goal_id}, "stamp": self.stamp}

    def publish_feedback(self, feedback: Mapping[str, Any]) -> None:
        self._server.feedback_publisher.publish({"goal_id": {"uuid": self.goal_id}, "feedback": feedback})

    def execute(self) -> None:
        self._server.set_status(self, GoalStatus.EXECUTING)

    def finish(self, status: GoalStatus, result: Mapping[str, Any]) -> None:
        """End the goal and send the result to the clients that requested it.

        :raises Ros2Error: if a client waits for the result, and the result does not have the type of the
            action; the goal then continues.
        """
        self._server.finish(self, status, result)


class GoalHandler:
    """Callbacks of a :class:`GoalServer`. The defaults accept each goal and each cancel request."""

    def decide(self, served_goal: ServedGoal) -> GoalResponse:  # noqa: ARG002 - for subclasses
        """Decide about a new goal, before the client gets a response."""
        return GoalResponse.ACCEPT_AND_EXECUTE

    def begin(self, served_goal: ServedGoal) -> None:
        """Start an accepted goal."""

    def may_cancel(self, served_goal: ServedGoal) -> bool:  # noqa: ARG002 - for subclasses
        """Return whether a goal may be cancelled on a client's request."""
        return True


class GoalServer(Closing):
    """Server of an action. A :class:`GoalHandler` decides about goals and executes them.

    :param clock: the clock for the stamps of goals.
    :param right: the right that clients need to send a goal.
    :raises Ros2Error: if the name or type is invalid.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: str,
        handler: GoalHandler,
        clock: Clock,
        *,
        right: Right = Right.PROGRAMS,
    ) -> None:
        type_name = parse_type(action_type, "action")
        self._handler, self._clock = handler, clock
        self._goals: dict[bytes, ServedGoal] = {}
        self._result_responses: dict[bytes, Mapping[str, Any]] = {}
        self._result_requests: dict[bytes, list[SendResponse]] = {}
        self.feedback_publisher = node.create_publisher(
            f"{name}/_action/feedback", str(type_name.derive("FeedbackMessage"))
        )
        self._status_publisher = node.create_publisher(
            f"{name}/_action/status", STATUS_TYPE, PROFILES["action_status"]
        )
        self._close_functions = [
            node.serve(
                f"{name}/_action/send_goal",
                str(type_name.derive("SendGoal")),
                self._handle_goal_request,
                right=right,
            ),
            node.serve_later(
                f"{name}/_action/get_result",
                str(type_name.derive("GetResult")),
                self._handle_result_request,
                right=right_of_frame("ros2-action", "get_result"),
            ),
            node.serve(
                f"{name}/_action/cancel_goal",
                CANCEL_GOAL_TYPE,
                self._handle_cancel_request,
                right=right_of_frame("ros2-action", "cancel_goal"),
                make_refusal=lambda _request, _reason: {"return_code": CancelCode.REJECTED},
            ),
        ]

    @property
    def running_goals(self) -> list[ServedGoal]:
        return [
            served_goal
            for goal_id, served_goal in self._goals.items()
            if goal_id not in self._result_responses
        ]

    def set_status(self, served_goal: ServedGoal, status: GoalStatus) -> None:
        served_goal.status = status
        self._publish_status()

    def finish(self, served_goal: ServedGoal, status: GoalStatus, result: Mapping[str, Any]) -> None:
        """End a goal and answer the requests for its result."""
        goal_id = served_goal.goal_id
        response = {"status": status, "result": result}
        # a wrong result is an error of the first reply: the goal then continues
        for reply in self._result_requests.get(goal_id, ()):
            reply(response)
        self._result_requests.pop(goal_id, None)
        self._result_responses[goal_id] = response
        self.set_status(served_goal, status)
        while len(self._result_responses) > _MAX_RESULTS:
            oldest_id = next(iter(self._result_responses))
            del self._result_responses[oldest_id], self._goals[oldest_id]

    def close(self) -> None:
        for served_goal in self.running_goals:
            self.finish(served_goal, GoalStatus.ABORTED, {})
        publishers = (self.feedback_publisher, self._status_publisher)
        for close_endpoint in (*self._close_functions, *(publisher.close for publisher in publishers)):
            close_endpoint()

    def _handle_goal_request(self, request: Message) -> Mapping[str, Any]:
        goal_id = request["goal_id"]["uuid"]
        served_goal = ServedGoal(self, goal_id, request["goal"], us_to_stamp(self._clock.now_us()))
        response = GoalResponse.REJECT if goal_id in self._goals else self._handler.decide(served_goal)
        if response == GoalResponse.REJECT:
            return {"accepted": False, "stamp": served_goal.stamp}
        self._goals[goal_id] = served_goal
        if response == GoalResponse.ACCEPT_AND_EXECUTE:
            served_goal.status = GoalStatus.EXECUTING
        self._handler.begin(served_goal)
        self._publish_status()
        return {"accepted": True, "stamp": served_goal.stamp}

    def _handle_cancel_request(self, request: Message) -> Mapping[str, Any]:
        goal_id = request["goal_info"]["goal_id"]["uuid"]
        named_goal = self._goals.get(goal_id)
        if named_goal is not None and named_goal.status.is_final:
            return {"return_code": CancelCode.GOAL_TERMINATED}
        if named_goal is None and any(goal_id):
            return {"return_code": CancelCode.UNKNOWN_GOAL_ID}
        # an id of zeros stands for several goals: all, or those accepted until the stamp of the request
        until_ns = stamp_to_ns(request["goal_info"]["stamp"])
        goals = (
            [named_goal]
            if named_goal
            else [goal for goal in self.running_goals if not until_ns or stamp_to_ns(goal.stamp) <= until_ns]
        )
        cancelled_goals = [goal for goal in goals if self._handler.may_cancel(goal)]
        for goal in cancelled_goals:
            goal.is_cancel_requested, goal.status = True, GoalStatus.CANCELING
        self._publish_status()
        return {
            "return_code": CancelCode.NONE if cancelled_goals else CancelCode.REJECTED,
            "goals_canceling": [goal.info for goal in cancelled_goals],
        }

    def _handle_result_request(self, request: Message, reply: SendResponse) -> None:
        goal_id = request["goal_id"]["uuid"]
        if goal_id in self._result_responses:
            reply(self._result_responses[goal_id])
        elif goal_id in self._goals:
            self._result_requests.setdefault(goal_id, []).append(reply)
        else:
            reply({"status": GoalStatus.UNKNOWN})

    def _publish_status(self) -> None:
        goals = self._goals.values()
        self._status_publisher.publish(
            {"status_list": [{"goal_info": goal.info, "status": goal.status} for goal in goals]}
        )


# The execution of a goal. A step yields feedback or None, and the generator returns the result. The generator
# raises `AbortedError` on failure, and returns early if `ServedGoal.is_cancel_requested` is set.
Execution = Generator[Mapping[str, Any] | None, None, Mapping[str, Any]]


class AbortedError(Exception):
    """The goal has failed.

    :param result: the result message for the client.
    """

    def __init__(self, result: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self.result: Mapping[str, Any] = {} if result is None else result


class ActionServer(Closing, GoalHandler):
    """Server of an action. A generator executes each goal; :meth:`step` advances all generators by one step.

    :param execute: starts the execution of a goal.
    :param clock: the clock for the stamps of goals.
    :param right: the right that clients need to send a goal.
    :raises Ros2Error: if the name or type is invalid.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: str,
        execute: Callable[[ServedGoal], Execution],
        clock: Clock,
        *,
        right: Right = Right.PROGRAMS,
    ) -> None:
        self._execute = execute
        self._executions: dict[bytes, tuple[ServedGoal, Execution]] = {}
        self._server = GoalServer(node, name, action_type, self, clock, right=right)

    @property
    def is_busy(self) -> bool:
        return bool(self._executions)

    def step(self) -> None:
        """Execute the next step of each goal."""
        for goal_id, (served_goal, execution) in list(self._executions.items()):
            try:
                feedback = next(execution)
            except StopIteration as end:
                status = GoalStatus.CANCELED if served_goal.is_cancel_requested else GoalStatus.SUCCEEDED
                self._finish(goal_id, status, end.value)
            except AbortedError as error:
                self._finish(goal_id, GoalStatus.ABORTED, error.result)
            else:
                if feedback is not None:
                    served_goal.publish_feedback(feedback)

    def close(self) -> None:
        """Abort all goals and close the server."""
        for goal_id in list(self._executions):
            self._finish(goal_id, GoalStatus.ABORTED, {})
        self._server.close()

    def begin(self, served_goal: ServedGoal) -> None:
        self._executions[served_goal.goal_id] = (served_goal, self._execute(served_goal))

    def _finish(self, goal_id: bytes, status: GoalStatus, result: Mapping[str, Any]) -> None:
        served_goal, execution = self._executions.pop(goal_id)
        execution.close()
        served_goal.finish(status, result)
