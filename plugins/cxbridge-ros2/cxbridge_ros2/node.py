"""The interface of a ROS 2 node, for every transport. :mod:`cxbridge_ros2.actions` builds on it.

A node does nothing by itself. :meth:`Node.poll` receives messages and calls the callbacks in the polling
thread.
"""

from __future__ import annotations

import warnings
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from msgspec import Struct

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.closing import Closing
from cxbridge.errors import Ros2Error
from cxbridge.rights import EVERYTHING, Right, Rights
from cxbridge_ros2.messages import Message
from cxbridge_ros2.qos import PROFILES, QosProfile

Receive = Callable[[Message], None]  # handles a message

# Handles a complaint about another node: a broken message, or a mismatch of type or QoS.
Report = Callable[[str], None]

Failed = Callable[[str], None]  # called with the reason why a call has no response

Answer = Callable[[Message], Mapping[str, Any]]  # handles a request and returns the response

Reply = Callable[[Mapping[str, Any]], None]  # sends the response to a request; called once

# Handles a request, and calls the reply function at once or later.
AnswerLater = Callable[[Message, Reply], None]

# Returns the response to a refused request; called with the request and the reason.
Refuse = Callable[[Message, str], Mapping[str, Any]]


class Domain(Struct, frozen=True):
    """The domain of a node; each transport reads the fields that it knows.

    :param number: the number of the domain, or None for that of the environment.
    :param url: the URL of a bridge or router; empty for the default of the transport.
    :param reach: how far discovery goes, or None for the range of the environment.
    """

    number: int | None = None
    url: str = ""
    reach: str | None = None


def _empty(_request: Message, _reason: str) -> Mapping[str, Any]:
    """Return a response with default fields: false, 0, empty."""
    return {}


class Ros2Warning(UserWarning):
    """A problem of another node."""


def _warn(text: str) -> None:
    warnings.warn(text, Ros2Warning, stacklevel=4)


class Publisher(ABC):
    @abstractmethod
    def publish(self, message: Mapping[str, Any]) -> None:
        """Send a message.

        :raises Ros2Error: if the message has another type.
        """

    @property
    @abstractmethod
    def subscriptions(self) -> int:
        """The current number of subscriptions, as far as the transport knows."""

    @abstractmethod
    def close(self) -> None: ...


class Client(ABC):
    @abstractmethod
    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        """Send a request and return its number; ``done`` is called with the response.

        :param failed: called with the reason if there is no response and the transport knows it.
        :raises Ros2Error: if the request has another type.
        """

    @abstractmethod
    def forget(self, number: int) -> None:
        """Stop waiting for a response."""

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

    def _intact(self, place: str, decode: Callable[[], Message]) -> Message | None:
        """Return a received message, or None after reporting a broken message.

        :param place: the topic or service.
        """
        try:
            return decode()
        except Ros2Error as error:
            self.complain(f"broken {place}", f"{place}: {error.message}")
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
        receive: Receive,
        qos: QosProfile = PROFILES["default"],
        *,
        needs: Right = Right.PROGRAMS,
    ) -> Callable[[], None]:
        """Call ``receive`` for each message of a topic; return the function that ends the subscription.

        :param needs: the right to send messages; without it, each message is reported and dropped.
        :raises Ros2Error: if the topic or type is invalid.
        """
        if not self.rights.allow(needs):

            def receive(_message: Message) -> None:
                self._refusal(topic, needs)

        return self._subscribe(topic, message_type, receive, qos)

    @abstractmethod
    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
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
        answer: Answer,
        *,
        needs: Right = Right.PROGRAMS,
        refuse: Refuse = _empty,
    ) -> Callable[[], None]:
        """Serve a service with immediate responses; see :meth:`serve_later`."""

        def later(request: Message, reply: Reply) -> None:
            reply(answer(request))

        return self.serve_later(service, service_type, later, needs=needs, refuse=refuse)

    def serve_later(
        self,
        service: str,
        service_type: str,
        answer: AnswerLater,
        *,
        needs: Right = Right.PROGRAMS,
        refuse: Refuse = _empty,
    ) -> Callable[[], None]:
        """Serve a service with immediate or later responses; return the function that ends the service.

        :param needs: the right to send requests.
        :param refuse: makes the response to requests without that right.
        :raises Ros2Error: if the name or type is invalid.
        """
        if not self.rights.allow(needs):

            def answer(request: Message, reply: Reply) -> None:
                reply(refuse(request, self._refusal(service, needs)))

        return self._serve_later(service, service_type, answer)

    def _refusal(self, place: str, needs: Right) -> str:
        """Report a request without the right, and return the reason of its refusal."""
        reason = f"refused: {place}: {self.rights.why_not(needs)}"
        self.complain(f"refused {place}", reason)
        return reason

    @abstractmethod
    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        """Serve without a check of rights; see :meth:`serve_later`."""

    @abstractmethod
    def poll(self, timeout_s: float = 0.0) -> bool:
        """Handle received messages, or wait for the first; return whether any were received."""
