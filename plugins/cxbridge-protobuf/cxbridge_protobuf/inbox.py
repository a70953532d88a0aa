"""The queue of received messages that wait for their environment."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeAlias

from cxbridge_protobuf.types import Message

_MOST_BYTES: Final = 64 << 20  # also bounds few large messages


class Origin(Enum):
    """The kind of connection an event came from: the slot ``client-type`` of facts."""

    SERVER = "SERVER"
    CLIENT = "CLIENT"
    PEER = "PEER"


@dataclass(frozen=True, slots=True)
class Received:
    """A received message.

    :param link: the id of the connection or of the peer.
    :param message: None if it is invalid.
    :param problem: the reason why it is invalid.
    """

    origin: Origin
    link: int
    host: str
    port: int
    component: int
    type: int
    at_us: int
    message: Message | None
    problem: str = ""


@dataclass(frozen=True, slots=True)
class Presence:
    """The start or end of a connection."""

    origin: Origin
    link: int
    connected: bool
    host: str = ""
    port: int = 0


@dataclass(frozen=True, slots=True)
class Warned:
    """A line for the log."""

    text: str


Event: TypeAlias = Received | Presence | Warned


class Inbox:
    """Events in order of arrival; thread-safe.

    :param limit: the maximal number of waiting messages.
    """

    def __init__(self, limit: int, now_us: Callable[[], int]) -> None:
        self.now_us: Final = now_us
        self._max_messages = limit
        self._lock = threading.Lock()
        self._events: list[Event] = []
        self._messages = 0
        self._bytes = 0
        self._was_full = False
        self._warning_counts: dict[str, int] = {}

    @property
    def full(self) -> bool:
        """Whether reading should pause; the next drain then reports a full inbox."""
        with self._lock:
            full = self._messages >= self._max_messages or self._bytes >= _MOST_BYTES
            self._was_full |= full  # the next drain resumes the paused connections
            return full

    def put(self, event: Event, size: int = 0) -> None:
        """Add an event.

        :param size: the message's size in bytes.
        """
        with self._lock:
            self._events.append(event)
            self._messages += isinstance(event, Received)
            self._bytes += size

    def warn(self, text: str, kind: str) -> None:
        """Add a log line: the 1st, 2nd, 4th, 8th ... of its kind, since a peer may cause many.

        :param kind: a text that no peer chooses.
        """
        with self._lock:
            count = self._warning_counts[kind] = self._warning_counts.get(kind, 0) + 1
            if count & (count - 1) == 0:
                suffix = f" ({count} times so far)" if count > 1 else ""
                self._events.append(Warned(text + suffix))

    def drain(self) -> tuple[list[Event], bool]:
        with self._lock:
            events, self._events = self._events, []
            was_full, self._was_full = self._was_full, False
            self._messages = self._bytes = 0
        return events, was_full
