"""The queue of messages from the network that wait for their environment."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import Final, TypeAlias

from cxbridge_protobuf.types import Message

_MOST_BYTES: Final = 64 << 20
"""Bytes of messages that wait, however few they are."""


class Origin(Enum):
    """Through what something came: the slot ``client-type`` of facts."""

    SERVER = "SERVER"
    CLIENT = "CLIENT"
    PEER = "PEER"


@dataclass(frozen=True, slots=True)
class Received:
    """A message.

    :param link: the id of the connection or of the peer.
    :param message: None when it could not be parsed.
    :param problem: why it could not.
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
    """A connection has begun or ended."""

    origin: Origin
    link: int
    connected: bool
    host: str = ""
    port: int = 0


@dataclass(frozen=True, slots=True)
class Warned:
    """Something for the log."""

    text: str


Event: TypeAlias = Received | Presence | Warned


class Inbox:
    """Events in the order they came; threads may share it.

    :param most: messages that may wait.
    """

    def __init__(self, most: int, now_us: Callable[[], int]) -> None:
        self.now_us: Final = now_us
        self._most = most
        self._lock = threading.Lock()
        self._events: list[Event] = []
        self._messages = 0
        self._bytes = 0
        self._was_full = False
        self._said: dict[str, int] = {}

    @property
    def full(self) -> bool:
        """Whether reading should pause; the next drain returns that it did."""
        with self._lock:
            full = self._messages >= self._most or self._bytes >= _MOST_BYTES
            self._was_full |= full
            return full

    def put(self, event: Event, size: int = 0) -> None:
        """Add an event.

        :param size: bytes of the message.
        """
        with self._lock:
            self._events.append(event)
            self._messages += isinstance(event, Received)
            self._bytes += size

    def warn(self, text: str, kind: str) -> None:
        """Add a line for the log: the 1st, 2nd, 4th, 8th ... of its kind, since a stranger may cause many.

        :param kind: nothing that a stranger chooses.
        """
        with self._lock:
            count = self._said[kind] = self._said.get(kind, 0) + 1
            if count & (count - 1) == 0:
                more = f" ({count} times so far)" if count > 1 else ""
                self._events.append(Warned(text + more))

    def drain(self) -> tuple[list[Event], bool]:
        """Return all events, and whether it was full."""
        with self._lock:
            events, self._events = self._events, []
            was_full, self._was_full = self._was_full, False
            self._messages = self._bytes = 0
        return events, was_full
