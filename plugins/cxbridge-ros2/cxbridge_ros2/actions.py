"""Actions: goals that take time, with feedback, and can be cancelled; by services and topics of a node."""

from __future__ import annotations

import uuid
from collections.abc import Callable, Generator, Mapping
from enum import IntEnum
from typing import Any, Final

from cxbridge.clock import MICROSECONDS, Clock
from cxbridge.closing import Closing
from cxbridge.rights import Right, right_of_frame
from cxbridge_ros2.builtin import CANCEL_GOAL
from cxbridge_ros2.messages import Message
from cxbridge_ros2.names import parse_type
from cxbridge_ros2.node import Client, Node
from cxbridge_ros2.qos import PROFILES

_STATUS_TYPE: Final = "action_msgs/msg/GoalStatusArray"


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
    def _missing_(cls, value: object) -> GoalStatus:  # noqa: ARG003  a peer may send any number
        return cls.UNKNOWN

    @property
    def is_final(self) -> bool:
        """Whether the goal has ended."""
        return self >= GoalStatus.SUCCEEDED


class CancelCode(IntEnum):
    """The answer of a server to a request to cancel a goal: action_msgs/srv/CancelGoal."""

    NONE = 0
    REJECTED = 1
    UNKNOWN_GOAL_ID = 2
    GOAL_TERMINATED = 3

    @classmethod
    def _missing_(cls, value: object) -> CancelCode:  # noqa: ARG003  a peer may send any number
        return cls.REJECTED


class GoalObserver:
    """Gets the events of a goal that was sent, in order. Override the methods that you need."""

    def answered(self, sent: SentGoal) -> None:
        """Note that the server has accepted or rejected the goal."""

    def feedback(self, sent: SentGoal, feedback: Message) -> None:
        """Note feedback."""

    def ended(self, sent: SentGoal) -> None:
        """Note that the goal has ended and has a result."""

    def cancel_answered(self, sent: SentGoal, response: Message) -> None:
        """Note the server's answer to a request to cancel the goal."""


class SentGoal:
    """A goal that was sent to a server. Its attributes change while the node is polled.

    :ivar is_accepted: None as long as the server has not answered.
    :ivar status: the last known status.
    :ivar feedback: the last feedback; None: none has come.
    :ivar result: the result message; None: the goal has not ended.
    :ivar reason: why there is no result of the server's, where the transport knows; else empty.
    :ivar is_cancelled: whether the server was asked to cancel it.
    :ivar refused_cancel: why the server does not cancel it; None: it does, or was not asked.
    :ivar servers: those that there were when the client looked last.
    :ivar stamp: when the server accepted the goal, in seconds; 0.0 before.
    """

    def __init__(self, client: ActionClient, number: bytes, observer: GoalObserver) -> None:
        self._client = client
        self.number = number
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
        """Whether the goal is over: rejected, or with a result."""
        return self.is_accepted is False or self.result is not None

    def cancel(self) -> None:
        """Ask the server to cancel it."""
        self._client.cancel(self)


class ActionClient(Closing):
    """Sends goals to the server of an action.

    :param name: the action's, e.g. ``/navigate_to_pose``.
    :param action_type: e.g. ``nav2_msgs/action/NavigateToPose``.
    :raises Ros2Error: for a name or a type that there is not.
    """

    def __init__(self, node: Node, name: str, action_type: str) -> None:
        kind = parse_type(action_type, "action")
        self._goals: dict[bytes, SentGoal] = {}
        self._send = node.client(f"{name}/_action/send_goal", str(kind.derived("SendGoal")))
        self._get = node.client(f"{name}/_action/get_result", str(kind.derived("GetResult")))
        self._cancel = node.client(f"{name}/_action/cancel_goal", CANCEL_GOAL)
        self._ends = [
            node.subscribe(
                f"{name}/_action/feedback",
                str(kind.derived("FeedbackMessage")),
                self._take_feedback,
                needs=Right.LOOK,  # answers to our goals
            ),
            node.subscribe(
                f"{name}/_action/status",
                _STATUS_TYPE,
                self._changed,
                PROFILES["action_status"],
                needs=Right.LOOK,
            ),
        ]

    @property
    def is_served(self) -> bool:
        """Whether there is a server now."""
        return all(each.is_served for each in self._clients)

    def why_unserved(self) -> str:
        """Return why there is no server, as far as the transport knows; empty when it does not."""
        return self._send.why_unserved()

    @property
    def _clients(self) -> tuple[Client, ...]:
        return self._send, self._get, self._cancel

    def send(self, goal: Mapping[str, Any], observer: GoalObserver | None = None) -> SentGoal:
        """Send a goal.

        :param observer: gets what happens to the goal.
        :raises Ros2Error: when it is none of the action's type.
        """
        number = uuid.uuid4().bytes
        sent = SentGoal(self, number, observer or GoalObserver())
        sent.servers = self._get.servers

        def answered(response: Message) -> None:
            sent.is_accepted = bool(response["accepted"])
            if not sent.is_accepted:
                self._goals.pop(number, None)
                sent.observer.answered(sent)
                return
            sent.stamp = _nanoseconds(response["stamp"]) / 1e9
            sent.status = max(sent.status, GoalStatus.ACCEPTED)
            sent.observer.answered(sent)
            self._want_result(sent)
            if sent.is_cancelled:  # the server may have refused it: it did not know the goal then
                self.cancel(sent)

        def failed(reason: str) -> None:
            self._give_up(sent, GoalStatus.ABORTED, reason)

        self._goals[number] = sent  # feedback may come before the answer
        try:
            self._send.call({"goal_id": {"uuid": number}, "goal": goal}, answered, failed)
        except Exception:
            del self._goals[number]
            raise
        return sent

    def look(self, sent: SentGoal) -> None:
        """See whether there is another server than before: one that was restarted knows nothing of a goal.

        Then the goal ends with the status UNKNOWN.
        """
        now = self._get.servers
        if now - sent.servers and sent.is_accepted:
            self._want_result(sent)
        elif now and sent.servers.isdisjoint(now) and sent.is_accepted is None:
            self._give_up(sent, GoalStatus.UNKNOWN, "")  # those that could have accepted it are gone
        sent.servers |= now

    def _give_up(self, sent: SentGoal, status: GoalStatus, reason: str) -> None:
        if self._goals.pop(sent.number, None) is not None:
            sent.status, sent.result, sent.reason = status, {}, reason
            sent.observer.ended(sent)

    def _want_result(self, sent: SentGoal) -> None:
        def ended(response: Message) -> None:
            if self._goals.pop(sent.number, None) is not None:
                sent.status = GoalStatus(response["status"])
                sent.result = response["result"]
                sent.observer.ended(sent)

        def failed(reason: str) -> None:
            self._give_up(sent, GoalStatus.ABORTED, reason)

        self._get.call({"goal_id": {"uuid": sent.number}}, ended, failed)

    def cancel(self, sent: SentGoal) -> None:
        """Ask the server to cancel a goal; again when it has accepted it, if that is not known yet."""
        sent.is_cancelled = True

        def answered(response: Message) -> None:
            code = CancelCode(response["return_code"])
            sent.refused_cancel = None if code == CancelCode.NONE else code
            sent.observer.cancel_answered(sent, response)

        self._cancel.call({"goal_info": {"goal_id": {"uuid": sent.number}}}, answered)

    def cancel_until(self, seconds: float, done: Callable[[Message], None]) -> None:
        """Ask the server to cancel the goals that it accepted until a time; 0.0: all goals.

        :param done: gets the response.
        """
        whole, rest = divmod(round(seconds * 1e9), 1_000_000_000)
        self._cancel.call({"goal_info": {"stamp": {"sec": whole, "nanosec": rest}}}, done)

    def forget(self, sent: SentGoal) -> None:
        """Wait for a goal no more: its server is gone."""
        self._goals.pop(sent.number, None)

    def close(self) -> None:
        """Send nothing more."""
        for each in self._clients:
            each.close()
        for end in self._ends:
            end()

    def _take_feedback(self, message: Message) -> None:
        sent = self._goals.get(message["goal_id"]["uuid"])
        if sent is not None:
            sent.feedback = message["feedback"]
            sent.observer.feedback(sent, message["feedback"])

    def _changed(self, message: Message) -> None:
        for each in message["status_list"]:
            sent = self._goals.get(each["goal_info"]["goal_id"]["uuid"])
            if sent is not None and not sent.status.is_final:
                sent.status = GoalStatus(each["status"])


class GoalResponse(IntEnum):
    """The decision of a server about a new goal."""

    REJECT = 1
    ACCEPT_AND_EXECUTE = 2
    ACCEPT_AND_DEFER = 3


class ServedGoal:
    """A goal that a server has got.

    :ivar goal: the goal message.
    :ivar wants_cancel: whether a client has requested to cancel the goal.
    """

    def __init__(self, server: GoalServer, number: bytes, goal: Message, stamp: Message) -> None:
        self._server = server
        self.number = number
        self.goal = goal
        self.stamp = stamp
        self.status = GoalStatus.ACCEPTED
        self.wants_cancel = False

    def publish_feedback(self, feedback: Mapping[str, Any]) -> None:
        """Publish feedback."""
        self._server.publish_feedback(self, feedback)

    def execute(self) -> None:
        """Note that a goal is executed whose execution was deferred."""
        self._server.change(self, GoalStatus.EXECUTING)

    def finish(self, status: GoalStatus, result: Mapping[str, Any]) -> None:
        """End the goal, and send the result to the clients that request it.

        :raises Ros2Error: when the result is not of the action's type; then the goal continues.
        """
        self._server.finish(self, status, result)


class GoalHandler:
    """Executes the goals of a server. Override the methods that you need."""

    def respond(self, served: ServedGoal) -> GoalResponse:  # noqa: ARG002
        """Return what becomes of a goal that comes; its sender does not know yet."""
        return GoalResponse.ACCEPT_AND_EXECUTE

    def begin(self, served: ServedGoal) -> None:
        """Take a goal that was accepted."""

    def may_cancel(self, served: ServedGoal) -> bool:  # noqa: ARG002
        """Return whether a goal may be cancelled, when a client wants that."""
        return True


class GoalServer(Closing):
    """Takes the goals of an action; its handler executes them.

    :param clock: for the goals' stamps.
    :param keep: results that are kept, for clients that ask late.
    :param needs: the right that a goal needs.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: str,
        handler: GoalHandler,
        clock: Clock,
        keep: int = 100,
        *,
        needs: Right = Right.PROGRAMS,
    ) -> None:
        kind = parse_type(action_type, "action")
        self._handler, self._clock, self._keep = handler, clock, keep
        self._goals: dict[bytes, ServedGoal] = {}
        self._results: dict[bytes, Mapping[str, Any]] = {}
        self._asked: dict[bytes, list[Callable[[Mapping[str, Any]], None]]] = {}
        self._feedback = node.publisher(f"{name}/_action/feedback", str(kind.derived("FeedbackMessage")))
        self._status = node.publisher(f"{name}/_action/status", _STATUS_TYPE, PROFILES["action_status"])
        self._ends = [
            node.serve(f"{name}/_action/send_goal", str(kind.derived("SendGoal")), self._sent, needs=needs),
            node.serve_later(
                f"{name}/_action/get_result",
                str(kind.derived("GetResult")),
                self._wanted,
                needs=right_of_frame("ros2-action", "get_result"),
            ),
            node.serve(
                f"{name}/_action/cancel_goal",
                CANCEL_GOAL,
                self._cancelled,
                needs=right_of_frame("ros2-action", "cancel_goal"),
                refuse=lambda _request, _reason: {"return_code": CancelCode.REJECTED},
            ),
        ]

    @property
    def running(self) -> list[ServedGoal]:
        """The goals that have not ended."""
        return [served for number, served in self._goals.items() if number not in self._results]

    def publish_feedback(self, served: ServedGoal, feedback: Mapping[str, Any]) -> None:
        """Publish feedback on a goal."""
        self._feedback.publish({"goal_id": {"uuid": served.number}, "feedback": feedback})

    def change(self, served: ServedGoal, status: GoalStatus) -> None:
        """Publish another status of a goal."""
        served.status = status
        self._publish_status()

    def finish(self, served: ServedGoal, status: GoalStatus, result: Mapping[str, Any]) -> None:
        """End a goal, and answer the requests for its result."""
        number = served.number
        response = {"status": status, "result": result}
        for answer in self._asked.get(number, ()):
            answer(response)
        self._asked.pop(number, None)
        self._results[number] = response
        self.change(served, status)
        while len(self._results) > self._keep:
            old = next(iter(self._results))
            del self._results[old], self._goals[old]

    def close(self) -> None:
        """Abort all goals, and serve no more."""
        for served in self.running:
            self.finish(served, GoalStatus.ABORTED, {})
        for end in self._ends:
            end()
        self._feedback.close()
        self._status.close()

    def _sent(self, request: Message) -> Mapping[str, Any]:
        number = request["goal_id"]["uuid"]
        served = ServedGoal(self, number, request["goal"], self._now())
        response = GoalResponse.REJECT if number in self._goals else self._handler.respond(served)
        if response == GoalResponse.REJECT:
            return {"accepted": False, "stamp": self._now()}
        self._goals[number] = served
        if response == GoalResponse.ACCEPT_AND_EXECUTE:
            served.status = GoalStatus.EXECUTING
        self._handler.begin(served)
        self._publish_status()
        return {"accepted": True, "stamp": served.stamp}

    def _cancelled(self, request: Message) -> Mapping[str, Any]:
        wanted = request["goal_info"]["goal_id"]["uuid"]
        known = self._goals.get(wanted)
        if known is not None and known.status.is_final:
            return {"return_code": CancelCode.GOAL_TERMINATED}
        if known is None and any(wanted):
            return {"return_code": CancelCode.UNKNOWN_GOAL_ID}
        stamp = _nanoseconds(request["goal_info"]["stamp"])
        # no id: all goals, or those until the stamp
        meant = (
            [known]
            if known
            else [each for each in self.running if not stamp or _nanoseconds(each.stamp) <= stamp]
        )
        chosen = [each for each in meant if self._handler.may_cancel(each)]
        for each in chosen:
            each.wants_cancel, each.status = True, GoalStatus.CANCELING
        self._publish_status()
        return {
            "return_code": CancelCode.NONE if chosen else CancelCode.REJECTED,
            "goals_canceling": [{"goal_id": {"uuid": each.number}, "stamp": each.stamp} for each in chosen],
        }

    def _wanted(self, request: Message, answer: Callable[[Mapping[str, Any]], None]) -> None:
        number = request["goal_id"]["uuid"]
        if number in self._results:
            answer(self._results[number])
        elif number in self._goals:
            self._asked.setdefault(number, []).append(answer)
        else:
            answer({"status": GoalStatus.UNKNOWN})

    def _publish_status(self) -> None:
        self._status.publish(
            {
                "status_list": [
                    {
                        "goal_info": {"goal_id": {"uuid": each.number}, "stamp": each.stamp},
                        "status": each.status,
                    }
                    for each in self._goals.values()
                ]
            }
        )

    def _now(self) -> Message:
        seconds, micros = divmod(self._clock.now_us(), MICROSECONDS)
        return {"sec": seconds, "nanosec": micros * 1000}


Execution = Generator[Mapping[str, Any] | None, None, Mapping[str, Any]]
"""Steps of a goal's execution: each may yield feedback. Its return value is the result; it ends with
:class:`AbortedError` when it fails, and sees :attr:`ServedGoal.wants_cancel`."""


class AbortedError(Exception):
    """A goal cannot be reached.

    :param result: the result message for the client.
    """

    def __init__(self, result: Mapping[str, Any] | None = None) -> None:
        super().__init__()
        self.result: Mapping[str, Any] = {} if result is None else result


class ActionServer(Closing, GoalHandler):
    """Executes the goals of an action, a step each time that :meth:`step` is called.

    :param execute: begins to execute a goal.
    :param accept: whether a goal is accepted; all are by default.
    :param clock: for the goals' stamps.
    :param keep: results that are kept, for clients that ask late.
    :param needs: the right that a goal needs.
    """

    def __init__(
        self,
        node: Node,
        name: str,
        action_type: str,
        execute: Callable[[ServedGoal], Execution],
        clock: Clock,
        accept: Callable[[Message], bool] = lambda _goal: True,
        keep: int = 100,
        *,
        needs: Right = Right.PROGRAMS,
    ) -> None:
        self._execute, self._accept = execute, accept
        self._running: dict[bytes, tuple[ServedGoal, Execution]] = {}
        self._server = GoalServer(node, name, action_type, self, clock, keep, needs=needs)

    @property
    def is_busy(self) -> bool:
        """Whether a goal is being executed."""
        return bool(self._running)

    def step(self) -> None:
        """Execute a step of each goal."""
        for number, (served, steps) in list(self._running.items()):
            try:
                feedback = next(steps)
            except StopIteration as end:
                status = GoalStatus.CANCELED if served.wants_cancel else GoalStatus.SUCCEEDED
                self._ended(number, status, end.value)
            except AbortedError as error:
                self._ended(number, GoalStatus.ABORTED, error.result)
            else:
                if feedback is not None:
                    served.publish_feedback(feedback)

    def close(self) -> None:
        """Abort all goals, and serve no more."""
        for number in list(self._running):
            self._ended(number, GoalStatus.ABORTED, {})
        self._server.close()

    def respond(self, served: ServedGoal) -> GoalResponse:
        """Accept a goal, unless it is refused."""
        return GoalResponse.ACCEPT_AND_EXECUTE if self._accept(served.goal) else GoalResponse.REJECT

    def begin(self, served: ServedGoal) -> None:
        """Execute a goal, from the next step on."""
        self._running[served.number] = (served, self._execute(served))

    def _ended(self, number: bytes, status: GoalStatus, result: Mapping[str, Any]) -> None:
        served, steps = self._running.pop(number)
        steps.close()
        served.finish(status, result)


def _nanoseconds(stamp: Message) -> int:
    return int(stamp["sec"]) * 1_000_000_000 + int(stamp["nanosec"])
