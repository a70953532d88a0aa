"""The queue in which received messages wait for their environment.

The thread of the network adds events; the thread of the environment removes them before each run of the
rules.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeAlias

from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.errors import ProtobufError
from cxbridge_protobuf.frames import Frame
from cxbridge_protobuf.types import Message, MessageTypes

# the limit of the waiting bytes, since a few large messages could fill the memory
_MAX_BYTES: Final = 64 << 20

MAX_MESSAGES: Final = 10_000  # the number of waiting messages at which reading pauses


class LinkRole(Enum):
    """The environment's end of a connection: the slot ``client-type`` of facts.

    ``SERVER``: a connection that the environment's server accepted; ``CLIENT``: a connection that the
    environment opened; ``PEER``: a broadcast peer of the environment.
    """

    SERVER = "SERVER"
    CLIENT = "CLIENT"
    PEER = "PEER"


@dataclass(frozen=True, slots=True)
class ReceivedMessage:
    """A received message.

    :param link_id: the id of the connection or of the peer.
    :param host: the address of the sender; empty for messages to a client.
    :param port: the port of the sender; 0 for messages to a client.
    :param component: the component id in the frame.
    :param type: the number of the message type in the frame.
    :param arrival_us: the time of the arrival in microseconds.
    :param message: the message; None for an invalid message.
    :param problem: the reason why the message is invalid; empty for a valid message.
    """

    role: LinkRole
    link_id: int
    host: str
    port: int
    component: int
    type: int
    arrival_us: int
    message: Message | None
    problem: str = ""


def parse_message(
    types: MessageTypes, frame: Frame, role: LinkRole, link_id: int, host: str, port: int, arrival_us: int
) -> ReceivedMessage:
    """Return the message of a frame, which may be invalid; see :class:`ReceivedMessage`."""
    message, problem = None, ""
    try:
        message = types.parse(frame)
    except ProtobufError as error:
        problem = error.message
    return ReceivedMessage(
        role, link_id, host, port, frame.component, frame.type, arrival_us, message, problem
    )


@dataclass(frozen=True, slots=True)
class ConnectionChange:
    """The start or end of a connection; only the start has host and port of the opposite end."""

    role: LinkRole
    link_id: int
    is_connected: bool
    host: str = ""
    port: int = 0


@dataclass(frozen=True, slots=True)
class LogWarning:
    """A warning for the log of the environment."""

    text: str


InboxEvent: TypeAlias = ReceivedMessage | ConnectionChange | LogWarning


class Inbox:
    """Events in order of arrival; thread-safe.

    :param now_us: the clock for the time stamps of messages.
    """

    def __init__(self, now_us: Callable[[], int]) -> None:
        self.now_us: Final = now_us
        self._lock = threading.Lock()
        self._events: list[InboxEvent] = []
        self._message_count = 0
        self._byte_count = 0
        self._was_full = False
        self._complaints = Complaints(lambda text: self.add_event(LogWarning(text)))

    def record_if_full(self) -> bool:
        """Return whether reading should pause; if so, the next :meth:`drain` reports a full inbox."""
        with self._lock:
            is_full = self._message_count >= MAX_MESSAGES or self._byte_count >= _MAX_BYTES
            # a caller pauses at a full inbox, and must resume after the next drain
            self._was_full |= is_full
            return is_full

    def add_event(self, event: InboxEvent, size: int = 0) -> None:
        """Add an event.

        :param size: the size of a received message in bytes; 0 for other events.
        """
        with self._lock:
            self._events.append(event)
            self._message_count += isinstance(event, ReceivedMessage)
            self._byte_count += size

    def warn(self, text: str, kind: str) -> None:
        """Add a warning, at most one a minute of a kind, since a peer may cause many warnings.

        :param kind: a text that peers cannot influence.
        """
        self._complaints.add(kind, text)

    def drain(self) -> tuple[list[InboxEvent], bool]:
        """Remove and return all events; also return whether :meth:`record_if_full` found a full inbox."""
        with self._lock:
            events, self._events = self._events, []
            was_full, self._was_full = self._was_full, False
            self._message_count = self._byte_count = 0
        return events, was_full
