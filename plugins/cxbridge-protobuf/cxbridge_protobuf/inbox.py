"""The queue of received messages that wait for their environment."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeAlias

from cxbridge_protobuf.types import Message

_MAX_BYTES: Final = (
    64 << 20
)  # bounds the memory of large messages, which are too few for the limit of messages


class Origin(Enum):
    """The kind of connection that an event belongs to: the slot ``client-type`` of facts."""

    SERVER = "SERVER"
    CLIENT = "CLIENT"
    PEER = "PEER"


@dataclass(frozen=True, slots=True)
class Received:
    """A received message.

    :param link: the id of the connection or of the peer.
    :param host: the address of the sender; empty for messages to a client.
    :param at_us: the time of the arrival in microseconds.
    :param message: the message; None if it is invalid.
    :param problem: the reason why the message is invalid.
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
    :param now_us: the clock for the time stamps of messages.
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
        """Whether reading should pause; if so, the next :meth:`drain` reports that the inbox was full."""
        with self._lock:
            full = self._messages >= self._max_messages or self._bytes >= _MAX_BYTES
            self._was_full |= full  # the network resumes paused connections after the next drain
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
        """Add the 1st, 2nd, 4th, 8th ... log line of a kind, since a peer may cause many.

        :param kind: a text that peers cannot influence, so that the number of kinds is bounded.
        """
        with self._lock:
            count = self._warning_counts[kind] = self._warning_counts.get(kind, 0) + 1
            if count & (count - 1) == 0:
                suffix = f" ({count} times so far)" if count > 1 else ""
                self._events.append(Warned(text + suffix))

    def drain(self) -> tuple[list[Event], bool]:
        """Remove all events; return them, and whether :attr:`full` was true since the last call."""
        with self._lock:
            events, self._events = self._events, []
            was_full, self._was_full = self._was_full, False
            self._messages = self._bytes = 0
        return events, was_full
