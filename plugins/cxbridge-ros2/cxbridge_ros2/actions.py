"""Clients and servers of ROS 2 actions, made from the services and topics of a node.

A client sends a goal (service ``send_goal``), at once requests its result (``get_result``, which the server
answers at the end), and may cancel it (``cancel_goal``). The topics ``feedback`` and ``status`` report what
happens in between.
"""

from __future__ import annotations

import uuid
from collections.abc import Callable, Generator, Mapping
from enum import IntEnum
from typing import Any, Final

from cxbridge.clock import Clock
from cxbridge.closing import Closing
from cxbridge.rights import Right, right_of_frame
from cxbridge_ros2.builtin import CANCEL_GOAL
from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Client, Node, SendResponse
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import nanoseconds_of, stamp_of

STATUS_TYPE: Final = "action_msgs/msg/GoalStatusArray"

_MAX_RESULTS: Final = 100  # results that a server keeps for late requests


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
    """Callbacks for the events of a sent goal, in order, with empty defaults."""

    def answered(self, sent: SentGoal) -> None:
        """Handle the acceptance or rejection of the goal."""

    def feedback(self, sent: SentGoal, feedback: Message) -> None:
        """Handle feedback about the goal."""

    def ended(self, sent: SentGoal) -> None:
        """Handle the end of the goal; its result is set."""

    def cancel_answered(self, sent: SentGoal, response: Message) -> None:
        """Handle the response to a cancel request."""


class SentGoal:
    """A goal that was sent to a server. Polling the node updates its attributes.

    :ivar is_accepted: None before the server's response.
    :ivar status: the last known status.
    :ivar feedback: the last feedback, or None.
    :ivar result: the result message; None before the end.
    :ivar reason: why the result is missing, if the transport knows; else empty.
    :ivar is_cancelled: whether a cancel request was sent.
    :ivar refused_cancel: the reason why the last cancel request was refused, or None.
    :ivar servers: the numbers of the servers at the last check.
    :ivar stamp: the time of the acceptance, in seconds of the epoch; 0.0 before.
    """

    def __init__(self, client: ActionClient, goal_id: bytes, observer: GoalObserver) -> None:
        self._client = client
        self.goal_id = goal_id
        self.observer = observer
        self.stamp = 0.0
        self.is_accepted: bool | None = None
        self.status = GoalStatus.UNKNOWN
        self.feedback: Message | None = None
        self.result: Message | None = None
        self.reason = ""
        self.refused_cancel: CancelCode | None = None
        self.is_cancelled = False
        self.servers: frozenset[int] = frozenset()

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
        kind = parse_type(action_type, "action")
        self._goals: dict[bytes, SentGoal] = {}
        self._send = node.client(f"{name}/_action/send_goal", str(kind.derived("SendGoal")))
        self._get = node.client(f"{name}/_action/get_result", str(kind.derived("GetResult")))
        self._cancel = node.client(f"{name}/_action/cancel_goal", CANCEL_GOAL)
        self._closers = [
            node.subscribe(
                f"{name}/_action/feedback",
                str(kind.derived("FeedbackMessage")),
                self._receive_feedback,
                needs=Right.LOOK,  # events of our own goals need no further right
            ),
            node.subscribe(
                f"{name}/_action/status",
                STATUS_TYPE,
                self._receive_status,
                PROFILES["action_status"],
                needs=Right.LOOK,
            ),
        ]

    @property
    def is_served(self) -> bool:
        return all(client.is_served for client in self._clients)

    def why_unserved(self) -> str:
        """Return why there is no server, if the transport knows; else empty."""
        return self._send.why_unserved()

    @property
    def _clients(self) -> tuple[Client, ...]:
        return self._send, self._get, self._cancel

    def send(self, goal: Mapping[str, Any], observer: GoalObserver | None = None) -> SentGoal:
        """Send a goal.

        :param observer: handles the events of the goal.
        :raises Ros2Error: if the goal does not have the type of the action.
        """
        goal_id = uuid.uuid4().bytes
        sent = SentGoal(self, goal_id, observer or GoalObserver())
        sent.servers = self._get.servers

        def answered(response: Message) -> None:
            sent.is_accepted = bool(response["accepted"])
            if not sent.is_accepted:
                self._goals.pop(goal_id, None)
                sent.observer.answered(sent)
                return
            sent.stamp = nanoseconds_of(response["stamp"]) / 1e9
            sent.status = max(sent.status, GoalStatus.ACCEPTED)  # the topic may have reported a later status
            sent.observer.answered(sent)
            self._request_result(sent)
            if sent.is_cancelled:  # an earlier cancel request may have been refused for an unknown goal
                self.cancel(sent)

        def failed(reason: str) -> None:
            self._give_up(sent, GoalStatus.ABORTED, reason)

        self._goals[goal_id] = sent  # feedback may arrive before the response
        try:
            self._send.call({"goal_id": {"uuid": goal_id}, "goal": goal}, answered, failed)
        except Exception:
            del self._goals[goal_id]
            raise
        return sent

    def check_server(self, sent: SentGoal) -> None:
        """End the goal with status UNKNOWN if its server has restarted and forgotten it."""
        present_servers = self._get.servers
        if present_servers - sent.servers and sent.is_accepted:
            # a new server does not know the goal: its response has the status UNKNOWN
            self._request_result(sent)
        elif present_servers and sent.servers.isdisjoint(present_servers) and sent.is_accepted is None:
            # all servers that could have accepted the goal are gone
            self._give_up(sent, GoalStatus.UNKNOWN, "")
        sent.servers |= present_servers

    def _give_up(self, sent: SentGoal, status: GoalStatus, reason: str) -> None:
        if self._goals.pop(sent.goal_id, None) is not None:
            sent.status, sent.result, sent.reason = status, {}, reason
            sent.observer.ended(sent)

    # The request is sent at once: the server holds the response until the goal ends.
    def _request_result(self, sent: SentGoal) -> None:
        def ended(response: Message) -> None:
            if self._goals.pop(sent.goal_id, None) is not None:
                sent.status = GoalStatus(response["status"])
                sent.result = response["result"]
                sent.observer.ended(sent)

        def failed(reason: str) -> None:
            self._give_up(sent, GoalStatus.ABORTED, reason)

        self._get.call({"goal_id": {"uuid": sent.goal_id}}, ended, failed)

    def cancel(self, sent: SentGoal) -> None:
        """Send a cancel request; if the goal is not accepted yet, send it again after the acceptance."""
        sent.is_cancelled = True

        def answered(response: Message) -> None:
            code = CancelCode(response["return_code"])
            sent.refused_cancel = None if code == CancelCode.NONE else code
            sent.observer.cancel_answered(sent, response)

        self._cancel.call({"goal_info": {"goal_id": {"uuid": sent.goal_id}}}, answered)

    def cancel_until(self, seconds: float, done: Callable[[Message], None]) -> None:
        """Request to cancel the goals accepted until a time in seconds; 0.0 means all goals.

        :param done: called with the response.
        """
        sec, nanosec = divmod(round(seconds * 1e9), 10**9)
        self._cancel.call({"goal_info": {"stamp": {"sec": sec, "nanosec": nanosec}}}, done)

    def forget(self, sent: SentGoal) -> None:
        """Stop waiting for a goal whose server is gone."""
        self._goals.pop(sent.goal_id, None)

    def close(self) -> None:
        for client in self._clients:
            client.close()
        for end in self._closers:
            end()

    def _receive_feedback(self, message: Message) -> None:
        sent = self._goals.get(message["goal_id"]["uuid"])
        if sent is not None:
            sent.feedback = message["feedback"]
            sent.observer.feedback(sent, message["feedback"])

    def _receive_status(self, message: Message) -> None:
        for goal_status in message["status_list"]:
            sent = self._goals.get(goal_status["goal_info"]["goal_id"]["uuid"])
            if sent is not None and not sent.status.is_final:
                sent.status = GoalStatus(goal_status["status"])


class GoalResponse(IntEnum):
    """The server's decision about a new goal."""

    REJECT = 1
    ACCEPT_AND_EXECUTE = 2
    ACCEPT_AND_DEFER = 3


class ServedGoal:
    """A goal at the server.

    :ivar wants_cancel: whether a client has requested to cancel the goal.
    """

    def __init__(self, server: GoalServer, goal_id: bytes, goal: Message, stamp: Message) -> None:
        self._server = server
        self.goal_id = goal_id
        self.goal = goal
        self.stamp = stamp
        self.status = GoalStatus.ACCEPTED
        self.wants_cancel = False

    @property
    def info(self) -> Message:
        """The goal's action_msgs/msg/GoalInfo."""
        return {"goal_id": {"uuid": self.goal_id}, "stamp": self.stamp}

    def publish_feedback(self, feedback: Mapping[str, Any]) -> None:
        self._server.publish_feedback(self, feedback)

    def execute(self) -> None:
        self._server.set_status(self, GoalStatus.EXECUTING)

    def finish(self, status: GoalStatus, result: Mapping[str, Any]) -> None:
        """End the goal and send the result to the clients that requested it.

        :raises Ros2Error: if the result does not have the type of the action; the goal then continues.
        """
        self._server.finish(self, status, result)


class GoalHandler:
    """Callbacks of a goal server, with defaults that accept each goal."""

    def respond(self, served: ServedGoal) -> GoalResponse:  # noqa: ARG002
        """Decide about a new goal, whose client has no response yet."""
        return GoalResponse.ACCEPT_AND_EXECUTE

    def begin(self, served: ServedGoal) -> None:
        """Start an accepted goal."""

    def may_cancel(self, served: ServedGoal) -> bool:  # noqa: ARG002
        """Return whether a goal may be cancelled on a client's request."""
        return True


class GoalServer(Closing):
    """Server of an action; its handler executes the goals.

    :param clock: the clock for the stamps of goals.
    :param needs: the right that clients need to send a goal.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: str,
        handler: GoalHandler,
        clock: Clock,
        *,
        needs: Right = Right.PROGRAMS,
    ) -> None:
        kind = parse_type(action_type, "action")
        self._handler, self._clock = handler, clock
        self._goals: dict[bytes, ServedGoal] = {}
        self._results: dict[bytes, Mapping[str, Any]] = {}
        self._result_requests: dict[bytes, list[SendResponse]] = {}
        self._feedback = node.publisher(f"{name}/_action/feedback", str(kind.derived("FeedbackMessage")))
        self._status = node.publisher(f"{name}/_action/status", STATUS_TYPE, PROFILES["action_status"])
        self._closers = [
            node.serve(
                f"{name}/_action/send_goal", str(kind.derived("SendGoal")), self._respond, needs=needs
            ),
            node.serve_later(
                f"{name}/_action/get_result",
                str(kind.derived("GetResult")),
                self._get_result,
                needs=right_of_frame("ros2-action", "get_result"),
            ),
            node.serve(
                f"{name}/_action/cancel_goal",
                CANCEL_GOAL,
                self._cancel,
                needs=right_of_frame("ros2-action", "cancel_goal"),
                refuse=lambda _request, _reason: {"return_code": CancelCode.REJECTED},
            ),
        ]

    @property
    def running(self) -> list[ServedGoal]:
        return [served for goal_id, served in self._goals.items() if goal_id not in self._results]

    def publish_feedback(self, served: ServedGoal, feedback: Mapping[str, Any]) -> None:
        self._feedback.publish({"goal_id": {"uuid": served.goal_id}, "feedback": feedback})

    def set_status(self, served: ServedGoal, status: GoalStatus) -> None:
        served.status = status
        self._publish_status()

    def finish(self, served: ServedGoal, status: GoalStatus, result: Mapping[str, Any]) -> None:
        """End a goal and answer the requests for its result."""
        goal_id = served.goal_id
        response = {"status": status, "result": result}
        # a wrong result is an error of the first reply: the goal then continues
        for reply in self._result_requests.get(goal_id, ()):
            reply(response)
        self._result_requests.pop(goal_id, None)
        self._results[goal_id] = response
        self.set_status(served, status)
        while len(self._results) > _MAX_RESULTS:
            oldest = next(iter(self._results))
            del self._results[oldest], self._goals[oldest]

    def close(self) -> None:
        for served in self.running:
            self.finish(served, GoalStatus.ABORTED, {})
        for end in self._closers:
            end()
        self._feedback.close()
        self._status.close()

    def _respond(self, request: Message) -> Mapping[str, Any]:
        goal_id = request["goal_id"]["uuid"]
        served = ServedGoal(self, goal_id, request["goal"], stamp_of(self._clock.now_us()))
        response = GoalResponse.REJECT if goal_id in self._goals else self._handler.respond(served)
        if response == GoalResponse.REJECT:
            return {"accepted": False, "stamp": served.stamp}
        self._goals[goal_id] = served
        if response == GoalResponse.ACCEPT_AND_EXECUTE:
            served.status = GoalStatus.EXECUTING
        self._handler.begin(served)
        self._publish_status()
        return {"accepted": True, "stamp": served.stamp}

    def _cancel(self, request: Message) -> Mapping[str, Any]:
        goal_id = request["goal_info"]["goal_id"]["uuid"]
        goal = self._goals.get(goal_id)
        if goal is not None and goal.status.is_final:
            return {"return_code": CancelCode.GOAL_TERMINATED}
        if goal is None and any(goal_id):
            return {"return_code": CancelCode.UNKNOWN_GOAL_ID}
        # an id of zeros is no id; then all goals are meant, or all that were accepted until the stamp
        until_ns = nanoseconds_of(request["goal_info"]["stamp"])
        goals = (
            [goal]
            if goal
            else [goal for goal in self.running if not until_ns or nanoseconds_of(goal.stamp) <= until_ns]
        )
        cancelled = [goal for goal in goals if self._handler.may_cancel(goal)]
        for goal in cancelled:
            goal.wants_cancel, goal.status = True, GoalStatus.CANCELING
        self._publish_status()
        return {
            "return_code": CancelCode.NONE if cancelled else CancelCode.REJECTED,
            "goals_canceling": [goal.info for goal in cancelled],
        }

    def _get_result(self, request: Message, reply: SendResponse) -> None:
        goal_id = request["goal_id"]["uuid"]
        if goal_id in self._results:
            reply(self._results[goal_id])
        elif goal_id in self._goals:
            self._result_requests.setdefault(goal_id, []).append(reply)
        else:
            reply({"status": GoalStatus.UNKNOWN})

    def _publish_status(self) -> None:
        goals = self._goals.values()
        self._status.publish(
            {"status_list": [{"goal_info": goal.info, "status": goal.status} for goal in goals]}
        )


# A goal's execution. Each step may yield feedback, and the return value is the result. It raises
# `AbortedError` on failure and checks `ServedGoal.wants_cancel`.
Execution = Generator[Mapping[str, Any] | None, None, Mapping[str, Any]]


class AbortedError(Exception):
    """The goal has failed.

    :param result: the result message for the client.
    """

    def __init__(self, result: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self.result: Mapping[str, Any] = {} if result is None else result


class ActionServer(Closing, GoalHandler):
    """Server that executes one step of each goal per call of :meth:`step`.

    :param execute: starts the execution of a goal.
    :param clock: the clock for the stamps of goals.
    :param needs: the right that clients need to send a goal.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: str,
        execute: Callable[[ServedGoal], Execution],
        clock: Clock,
        *,
        needs: Right = Right.PROGRAMS,
    ) -> None:
        self._execute = execute
        self._running: dict[bytes, tuple[ServedGoal, Execution]] = {}
        self._server = GoalServer(node, name, action_type, self, clock, needs=needs)

    @property
    def is_busy(self) -> bool:
        return bool(self._running)

    def step(self) -> None:
        """Execute the next step of each goal."""
        for goal_id, (served, steps) in list(self._running.items()):
            try:
                feedback = next(steps)
            except StopIteration as end:
                status = GoalStatus.CANCELED if served.wants_cancel else GoalStatus.SUCCEEDED
                self._finish(goal_id, status, end.value)
            except AbortedError as error:
                self._finish(goal_id, GoalStatus.ABORTED, error.result)
            else:
                if feedback is not None:
                    served.publish_feedback(feedback)

    def close(self) -> None:
        """Abort all goals and close the server."""
        for goal_id in list(self._running):
            self._finish(goal_id, GoalStatus.ABORTED, {})
        self._server.close()

    def begin(self, served: ServedGoal) -> None:
        self._running[served.goal_id] = (served, self._execute(served))

    def _finish(self, goal_id: bytes, status: GoalStatus, result: Mapping[str, Any]) -> None:
        served, steps = self._running.pop(goal_id)
        steps.close()
        served.finish(status, result)
