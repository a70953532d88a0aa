"""The interface of a ROS 2 node, which each transport implements.

A node does nothing by itself. :meth:`Node.poll` receives messages and calls the callbacks in the polling
thread, so that callbacks may use the blackboard and the executive without locks. Actions are made of the
services and topics of a node, in :mod:`cxbridge_ros2.actions`.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any, Final

from msgspec import Struct

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.closing import Closing
from cxbridge.errors import Ros2Error
from cxbridge.rights import ALL_RIGHTS, Right, Rights
from cxbridge_ros2.messages import Message
from cxbridge_ros2.qos import PROFILES, QosProfile

MessageCallback = Callable[[Message], None]

# Receives a text about a problem of another node: a broken message, or a mismatch of type or QoS.
ProblemCallback = Callable[[str], None]

FailureCallback = Callable[[str], None]  # receives the reason why a call has no response

SendResponse = Callable[[Mapping[str, Any]], None]  # sends the response to a request; called once

# Handles a request, and sends the response at once or later.
RequestHandler = Callable[[Message, SendResponse], None]

# Makes the response to a refused request, from the request and the reason.
RefusalFactory = Callable[[Message, str], Mapping[str, Any]]


def _make_empty_response(_request: Message, _reason: str) -> Mapping[str, Any]:
    """Return a response with default fields: false, 0, empty."""
    return {}


class Ros2Warning(UserWarning):
    """A problem of another node."""


# Level 1 of the stack is Complaints.add, 2 is Node.complain, 3 is the caller of Node.complain.
_warn: Final = partial(warnings.warn, category=Ros2Warning, stacklevel=3)


class Publisher(Struct, frozen=True, eq=False):
    """Sends messages on a topic.

    :param publish: sends a message; raises `Ros2Error` if the message does not have the topic's type.
    :param count_subscriptions: returns the number of subscriptions, as far as the transport knows.
    :param close: ends the publisher.
    """

    publish: Callable[[Mapping[str, Any]], None]
    count_subscriptions: Callable[[], int]
    close: Callable[[], None]


class Client(ABC):
    """A client of a service. Each request has a number."""

    def __init__(self) -> None:
        self._numbers = count(1)
        self._pending_callbacks: dict[int, tuple[MessageCallback, FailureCallback | None]] = {}

    def _register_request(self, on_response: MessageCallback, on_failure: FailureCallback | None) -> int:
        number = next(self._numbers)
        self._pending_callbacks[number] = on_response, on_failure
        return number

    @abstractmethod
    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        """Send a request and return its number.

        :param on_response: called with the response.
        :param on_failure: called with the reason if the transport knows that there will be no response.
        :raises Ros2Error: if the request does not have the service's type.
        """

    def forget(self, number: int) -> None:
        """Stop waiting for a response."""
        self._pending_callbacks.pop(number, None)

    @property
    @abstractmethod
    def server_numbers(self) -> frozenset[int]:
        """The current servers. A restarted server has a new number."""

    @property
    def has_server(self) -> bool:
        return bool(self.server_numbers)

    def explain_missing_server(self) -> str:
        """Return why the service has no server; empty if the transport does not know."""
        return ""

    @abstractmethod
    def close(self) -> None: ...


class Node(Closing):
    """A node. Names of topics and services are absolute: ``/robot1/odom``.

    :param report: called with a text about a problem of another node, for each kind of problem at most once
        a minute. By default, the texts become Python warnings.
    :ivar rights: the rights of other nodes at this node.
    """

    rights: Rights = ALL_RIGHTS

    def __init__(self, report: ProblemCallback | None = None) -> None:
        self._complaints = Complaints(report or _warn)

    def complain(self, kind: str, text: str) -> None:
        """Report a problem of another node.

        :param kind: the kind of the problem; problems of one kind are reported together.
        """
        self._complaints.add(kind, text)

    def _try_decode(self, name: str, decode: Callable[[], Message]) -> Message | None:
        """Return a decoded message; report a broken message and return None.

        :param name: the topic or service.
        :param decode: decodes the message, and raises `Ros2Error` if the message is broken.
        """
        try:
            return decode()
        except Ros2Error as error:
            self.complain(f"broken {name}", f"{name}: {error.message}")
            return None

    @abstractmethod
    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        """Announce a publisher.

        :raises Ros2Error: if the topic or type is invalid.
        """

    def subscribe(
        self,
        topic: str,
        message_type: str,
        callback: MessageCallback,
        qos: QosProfile = PROFILES["default"],
        *,
        right: Right = Right.PROGRAMS,
    ) -> Callable[[], None]:
        """Call ``callback`` for each message of a topic; return the function that ends the subscription.

        :param right: the right that other nodes need; without the right, messages are reported and dropped.
        :raises Ros2Error: if the topic or type is invalid.
        """
        if not self.rights.allows(right):
            # subscribe all the same, so that the log tells why messages have no effect
            def callback(_message: Message) -> None:
                self._report_refusal(topic, right)

        return self._subscribe(topic, message_type, callback, qos)

    @abstractmethod
    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        """Subscribe without a check of rights; see :meth:`subscribe`."""

    @abstractmethod
    def create_client(self, service: str, service_type: str) -> Client:
        """Make a client of a service.

        :raises Ros2Error: if the name or type is invalid.
        """

    def serve(
        self,
        service: str,
        service_type: str,
        handler: Callable[[Message], Mapping[str, Any]],
        *,
        right: Right = Right.PROGRAMS,
        make_refusal: RefusalFactory = _make_empty_response,
    ) -> Callable[[], None]:
        """Serve a service whose handler returns the response; see :meth:`serve_later`."""

        def respond(request: Message, reply: SendResponse) -> None:
            reply(handler(request))

        return self.serve_later(service, service_type, respond, right=right, make_refusal=make_refusal)

    def serve_later(
        self,
        service: str,
        service_type: str,
        handler: RequestHandler,
        *,
        right: Right = Right.PROGRAMS,
        make_refusal: RefusalFactory = _make_empty_response,
    ) -> Callable[[], None]:
        """Serve a service whose handler may respond later; return the function that ends the service.

        :param right: the right that clients need.
        :param make_refusal: makes the response to clients without the right.
        :raises Ros2Error: if the name or type is invalid.
        """
        if not self.rights.allows(right):

            def handler(request: Message, reply: SendResponse) -> None:
                reply(make_refusal(request, self._report_refusal(service, right)))

        return self._serve_later(service, service_type, handler)

    def _report_refusal(self, name: str, right: Right) -> str:
        """Report that a node without the right has used a topic or service; return the text."""
        reason = f"refused: {name}: {self.rights.refusal_hint(right)}"
        self.complain(f"refused {name}", reason)
        return reason

    @abstractmethod
    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        """Serve a service without a check of rights; see :meth:`serve_later`."""

    @abstractmethod
    def poll(self, timeout_s: float = 0.0) -> bool:
        """Call the callbacks for received messages; return whether there were messages.

        :param timeout_s: the time limit for the first message.
        """
