"""The interface of a ROS 2 node, for every transport. :mod:`cxbridge_ros2.actions` builds on it.

A node does nothing by itself. :meth:`Node.poll` receives messages and calls the callbacks in the polling
thread, so that callbacks may touch the blackboard and the executive without locks.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from itertools import count
from typing import Any

from msgspec import Struct

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.closing import Closing
from cxbridge.errors import Ros2Error
from cxbridge.rights import EVERYTHING, Right, Rights
from cxbridge_ros2.messages import Message
from cxbridge_ros2.qos import PROFILES, QosProfile

MessageCallback = Callable[[Message], None]

# Gets a problem of another node: a broken message, or a mismatch of type or QoS.
Report = Callable[[str], None]

FailureCallback = Callable[[str], None]  # gets the reason why a call has no response

SendResponse = Callable[[Mapping[str, Any]], None]  # sends the response to a request; called once

# Gets a request, and sends the response at once or later.
RequestHandler = Callable[[Message, SendResponse], None]

# Makes the response to a refused request from the request and the reason.
RefusalResponse = Callable[[Message, str], Mapping[str, Any]]


class Domain(Struct, frozen=True):
    """The domain of a node; each transport reads the fields that it knows.

    :param number: the number of the domain; None for the domain of the environment.
    :param url: the URL of a bridge or router; empty for the default of the transport.
    :param reach: the range of discovery; None for the range of the environment.
    """

    number: int | None = None
    url: str = ""
    reach: str | None = None


def _empty_response(_request: Message, _reason: str) -> Mapping[str, Any]:
    """Return a response with default fields: false, 0, empty."""
    return {}


class Ros2Warning(UserWarning):
    """A problem of another node."""


def _warn(text: str) -> None:
    # level 1 is this function, 2 Complaints.add, 3 Node.complain, 4 its caller
    warnings.warn(text, Ros2Warning, stacklevel=4)


class Publisher(Struct, frozen=True, eq=False):
    """Sends messages on a topic.

    :param publish: sends a message; raises `Ros2Error` if the message does not have the topic's type.
    :param count_subscriptions: returns the number of subscriptions, as far as the transport knows.
    :param close: leaves the topic.
    """

    publish: Callable[[Mapping[str, Any]], None]
    count_subscriptions: Callable[[], int]
    close: Callable[[], None]


class Client(ABC):
    """A client of a service, with the callbacks of its pending requests by number."""

    def __init__(self) -> None:
        self._numbers = count(1)
        self._pending: dict[int, tuple[MessageCallback, FailureCallback | None]] = {}

    def _add_request(self, done: MessageCallback, failed: FailureCallback | None) -> int:
        number = next(self._numbers)
        self._pending[number] = done, failed
        return number

    @abstractmethod
    def call(
        self, request: Mapping[str, Any], done: MessageCallback, failed: FailureCallback | None = None
    ) -> int:
        """Send a request and return its number; ``done`` is called with the response.

        :param failed: called with the reason if there is no response and the transport knows the reason.
        :raises Ros2Error: if the request does not have the service's type.
        """

    def forget(self, number: int) -> None:
        """Stop waiting for a response."""
        self._pending.pop(number, None)

    @property
    @abstractmethod
    def servers(self) -> frozenset[int]:
        """The current servers, each with a unique number."""

    @property
    def is_served(self) -> bool:
        return bool(self.servers)

    def why_unserved(self) -> str:
        """Return why there is no server, if the transport knows; else empty."""
        return ""

    @abstractmethod
    def close(self) -> None: ...


class Node(Closing):
    """A node. Names of topics and services are absolute: ``/robot1/odom``.

    :param report: called with complaints about other nodes, each kind at most once a minute; by default they
        are Python warnings.
    :ivar rights: the rights of clients of this node.
    """

    rights: Rights = EVERYTHING

    def __init__(self, report: Report | None = None) -> None:
        self._complaints = Complaints(report or _warn)

    def complain(self, kind: str, text: str) -> None:
        """Report a problem of another node.

        :param kind: identifies similar problems, which are reported together.
        """
        self._complaints.add(kind, text)

    def _decode_or_complain(self, name: str, decode: Callable[[], Message]) -> Message | None:
        """Return a received message, or None after reporting a broken message.

        :param name: the topic or service.
        """
        try:
            return decode()
        except Ros2Error as error:
            self.complain(f"broken {name}", f"{name}: {error.message}")
            return None

    @abstractmethod
    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        """Return a publisher.

        :raises Ros2Error: if the topic or type is invalid.
        """

    def subscribe(
        self,
        topic: str,
        message_type: str,
        callback: MessageCallback,
        qos: QosProfile = PROFILES["default"],
        *,
        needs: Right = Right.PROGRAMS,
    ) -> Callable[[], None]:
        """Call ``callback`` for each message of a topic; return the function that ends the subscription.

        :param needs: the right to send messages; without it, each message is reported and dropped.
        :raises Ros2Error: if the topic or type is invalid.
        """
        if not self.rights.allow(needs):
            # a node without the right subscribes too: its log shows that the right is missing
            def callback(_message: Message) -> None:
                self._report_refusal(topic, needs)

        return self._subscribe(topic, message_type, callback, qos)

    @abstractmethod
    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        """Subscribe without a check of rights; see :meth:`subscribe`."""

    @abstractmethod
    def client(self, service: str, service_type: str) -> Client:
        """Return a client of a service.

        :raises Ros2Error: if the name or type is invalid.
        """

    def serve(
        self,
        service: str,
        service_type: str,
        handler: Callable[[Message], Mapping[str, Any]],
        *,
        needs: Right = Right.PROGRAMS,
        refuse: RefusalResponse = _empty_response,
    ) -> Callable[[], None]:
        """Serve a service with immediate responses; see :meth:`serve_later`."""

        def respond(request: Message, reply: SendResponse) -> None:
            reply(handler(request))

        return self.serve_later(service, service_type, respond, needs=needs, refuse=refuse)

    def serve_later(
        self,
        service: str,
        service_type: str,
        handler: RequestHandler,
        *,
        needs: Right = Right.PROGRAMS,
        refuse: RefusalResponse = _empty_response,
    ) -> Callable[[], None]:
        """Serve a service with immediate or later responses; return the function that ends the service.

        :param needs: the right to send requests.
        :param refuse: makes the response to requests without that right.
        :raises Ros2Error: if the name or type is invalid.
        """
        if not self.rights.allow(needs):

            def handler(request: Message, reply: SendResponse) -> None:
                reply(refuse(request, self._report_refusal(service, needs)))

        return self._serve_later(service, service_type, handler)

    def _report_refusal(self, name: str, needs: Right) -> str:
        """Report a message to a topic or service without the right, and return the reason."""
        reason = f"refused: {name}: {self.rights.why_not(needs)}"
        self.complain(f"refused {name}", reason)
        return reason

    @abstractmethod
    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        """Serve without a check of rights; see :meth:`serve_later`."""

    @abstractmethod
    def poll(self, timeout_s: float = 0.0) -> bool:
        """Handle received messages, or wait for the first; return whether any were received."""
