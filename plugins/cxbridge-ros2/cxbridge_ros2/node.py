"""A node of ROS 2: what every transport offers. Actions are built on it (:mod:`cxbridge_ros2.actions`).

A node does nothing by itself. :meth:`Node.poll` takes incoming messages, and calls the callbacks in the
thread that polls.
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

Receive = Callable[[Message], None]
"""Gets a message."""

Report = Callable[[str], None]
"""Gets complaints about other nodes: a broken message, a type or a quality of service that does not fit."""

Failed = Callable[[str], None]
"""Gets the reason why a call has no response."""

Answer = Callable[[Message], Mapping[str, Any]]
"""Gets a request, and returns the response."""

Reply = Callable[[Mapping[str, Any]], None]
"""Sends the response to a request, once."""

AnswerLater = Callable[[Message, Reply], None]
"""Gets a request, and what sends the response, now or later."""

Refuse = Callable[[Message, str], Mapping[str, Any]]
"""Gets a request that clients may not send and the reason, and returns the response."""


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
    """Return the response whose fields have their defaults: false, 0, empty."""
    return {}


class Ros2Warning(UserWarning):
    """Something is wrong with another node."""


def _warn(text: str) -> None:
    warnings.warn(text, Ros2Warning, stacklevel=4)


class Publisher(ABC):
    """Sends messages to a topic."""

    @abstractmethod
    def publish(self, message: Mapping[str, Any]) -> None:
        """Send a message.

        :raises Ros2Error: when it is none of the topic's type.
        """

    @property
    @abstractmethod
    def subscriptions(self) -> int:
        """How many subscriptions there are now, as far as the transport knows."""

    @abstractmethod
    def close(self) -> None:
        """Publish nothing more."""


class Client(ABC):
    """Calls a service."""

    @abstractmethod
    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:
        """Send a request; ``done`` gets the response. Return the request's number.

        :param failed: gets the reason why there will be none, where the transport knows.
        :raises Ros2Error: when it is none of the service's type.
        """

    @abstractmethod
    def forget(self, number: int) -> None:
        """Wait for the response to a request no more."""

    @property
    @abstractmethod
    def servers(self) -> frozenset[int]:
        """The servers that exist now, each by a unique number."""

    @property
    def is_served(self) -> bool:
        """Whether there is a server now."""
        return bool(self.servers)

    def why_unserved(self) -> str:
        """Return why there is no server, as far as the transport knows; empty when it does not."""
        return ""

    @abstractmethod
    def close(self) -> None:
        """Call nothing more."""


class Node(Closing):
    """A node. Names of topics and services are whole: ``/robot1/odom``.

    :param report: gets complaints about other nodes, each kind at most once a minute; by default it is a
        warning of Python, a :class:`Ros2Warning`.
    :ivar rights: what clients may do over this node; a node of a program or of a terminal has everything.
    """

    rights: Rights = EVERYTHING

    def __init__(self, report: Report | None = None) -> None:
        self._complaints = Complaints(report or _warn)

    def complain(self, kind: str, text: str) -> None:
        """Report a problem of another node.

        :param kind: what problems have in common that count as the same.
        """
        self._complaints.add(kind, text)

    def _intact(self, place: str, decode: Callable[[], Message]) -> Message | None:
        """Return a message that came; None for one that is broken, which is reported.

        :param place: the topic or service that it came on.
        """
        try:
            return decode()
        except Ros2Error as error:
            self.complain(f"broken {place}", f"{place}: {error.message}")
            return None

    @abstractmethod
    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        """Return a publisher.

        :raises Ros2Error: for a topic or a type that there is not.
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

        :param needs: the right that the messages need; without it each message is reported and dropped.
        :raises Ros2Error: for a topic or a type that there is not.
        """
        if not self.rights.allow(needs):

            def receive(_message: Message) -> None:
                self._refusal(topic, needs)

        return self._subscribe(topic, message_type, receive, qos)

    @abstractmethod
    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
    ) -> Callable[[], None]:
        """Subscribe without regard to rights; see :meth:`subscribe`."""

    @abstractmethod
    def client(self, service: str, service_type: str) -> Client:
        """Return a client of a service.

        :raises Ros2Error: for a name or a type that there is not.
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
        """Answer the requests of a service at once; see :meth:`serve_later`."""

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
        """Answer the requests of a service when there is an answer; return the function that ends that.

        :param needs: the right that the requests need.
        :param refuse: makes the response to requests without that right.
        :raises Ros2Error: for a name or a type that there is not.
        """
        if not self.rights.allow(needs):

            def answer(request: Message, reply: Reply) -> None:
                reply(refuse(request, self._refusal(service, needs)))

        return self._serve_later(service, service_type, answer)

    def _refusal(self, place: str, needs: Right) -> str:
        """Report that a client asks for something without the right; return the reason."""
        reason = f"refused: {place}: {self.rights.why_not(needs)}"
        self.complain(f"refused {place}", reason)
        return reason

    @abstractmethod
    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        """Serve without regard to rights; see :meth:`serve_later`."""

    @abstractmethod
    def poll(self, timeout_s: float = 0.0) -> bool:
        """Hand out all that has come; wait so long for something. Return whether something had come."""
