"""The words that are exchanged on a hub, whatever the messages of a protocol call their fields."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

from msgspec import Struct

from cxbridge_ros2.messages import Message


class WordKind(IntEnum):
    """The kind of a word."""

    REQUEST = 1
    RESPONSE = 2
    CONFIRM = 3
    REJECT = 4
    FEEDBACK = 5
    FINISH = 6
    CANCEL = 7


class Life(IntEnum):
    """The state that a performer publishes once a second."""

    NOT_READY = 0
    READY = 1
    RUNNING = 2
    FAILURE = 4


class Key(NamedTuple):
    """The requested action. A hub has no tickets: two requests for one action cannot be told apart.

    :param agent: the robot; empty: there is one only.
    """

    action: str
    arguments: tuple[str, ...]
    agent: str

    def __str__(self) -> str:
        return f"({' '.join((self.action, *self.arguments))})"


class Word(Struct, frozen=True):
    """A word on the hub.

    :param kind: its kind; a number when the kind is unknown.
    :param node: the caller's node in REQUEST; else the performer's.
    :param key: the requested action.
    :param mapped: the skill string that the action is mapped to; empty: none, or the protocol has no such.
    :param success: of FINISH.
    :param progress: of FEEDBACK and FINISH, from 0 to 1.
    :param status: of FEEDBACK and FINISH: the current work, or the reason of the failure.
    """

    kind: int
    node: str
    key: Key
    mapped: str = ""
    success: bool = False
    progress: float = 0.0
    status: str = ""


class Sign(Struct, frozen=True):
    """A sign of life of a performer.

    :param life: its state, a :class:`Life`; a number when it is none that is known.
    """

    node: str
    action: str
    life: int


class HubProtocol(ABC):
    """A protocol: its topics, and what its messages call the fields of words."""

    name: ClassVar[str]
    """The protocol's name in a configuration."""

    topic: ClassVar[str]
    """The hub."""

    message_type: ClassVar[str]

    signs_topic: ClassVar[str]
    """Where performers give signs of life."""

    signs_type: ClassVar[str]

    patience_s: ClassVar[float]
    """Seconds that the original asks for a performer until it gives up."""

    wanted_s: ClassVar[float]
    """Seconds after a REQUEST in which an answer still makes sense: then it is repeated, or given up."""

    has_agents: ClassVar[bool] = False
    """Whether words name a robot."""

    @abstractmethod
    def message(self, word: Word) -> Mapping[str, Any]:
        """Return the message that says a word."""

    @abstractmethod
    def word(self, message: Message) -> Word:
        """Return the word of a message."""

    @abstractmethod
    def sign_message(self, sign: Sign, now_us: int) -> Mapping[str, Any]:
        """Return the message that is a sign of life.

        :param now_us: the time, microseconds since the epoch.
        """

    @abstractmethod
    def sign(self, message: Message) -> Sign:
        """Return the sign of life that a message is."""

    @abstractmethod
    def after_cancel(self, finish: Word) -> Word | None:
        """Return the last word of a performer after CANCEL; None: no word, as in the original.

        :param finish: its last word without CANCEL.
        """

    @abstractmethod
    def arguments_of(self, key: Key) -> tuple[str, ...]:
        """Return the arguments that a REQUEST is meant to have: some originals send one in place of none."""
