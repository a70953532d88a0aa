"""The messages on a hub, independent of a protocol's field names."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

from msgspec import Struct

from cxbridge_ros2.messages import Message


class WordKind(IntEnum):
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
    """The requested action. Hubs have no request ids, so two requests for one action are indistinguishable.

    :param agent: the robot; empty for a single robot.
    """

    action: str
    arguments: tuple[str, ...]
    agent: str

    def __str__(self) -> str:
        return f"({' '.join((self.action, *self.arguments))})"


class Word(Struct, frozen=True):
    """A message on the hub.

    :param kind: a :class:`WordKind`, or an unknown number.
    :param node: the caller's node in a REQUEST, else the performer's.
    :param key: the requested action.
    :param mapped: the skill string mapped to the action; may be empty.
    :param success: the result in a FINISH.
    :param progress: from 0 to 1, in FEEDBACK and FINISH.
    :param status: the current work or the error, in FEEDBACK and FINISH.
    """

    kind: int
    node: str
    key: Key
    mapped: str = ""
    success: bool = False
    progress: float = 0.0
    status: str = ""


class Sign(Struct, frozen=True):
    """A heartbeat of a performer.

    :param life: a :class:`Life`, or an unknown number.
    """

    node: str
    action: str
    life: int


class HubProtocol(ABC):
    """A protocol: its topics and the fields of its messages."""

    name: ClassVar[str]  # protocol's name in a configuration

    topic: ClassVar[str]  # topic of the hub

    message_type: ClassVar[str]

    signs_topic: ClassVar[str]  # topic of heartbeats

    signs_type: ClassVar[str]

    # Seconds after which the original gives up the search for a performer.
    patience_s: ClassVar[float]

    # Seconds in which a response to a REQUEST is useful; then the REQUEST is repeated or given up.
    wanted_s: ClassVar[float]

    has_agents: ClassVar[bool] = False  # whether messages name a robot

    @abstractmethod
    def message(self, word: Word) -> Mapping[str, Any]: ...

    @abstractmethod
    def word(self, message: Message) -> Word: ...

    @abstractmethod
    def sign_message(self, sign: Sign, now_us: int) -> Mapping[str, Any]:
        """Return the message for a heartbeat.

        :param now_us: microseconds since the epoch.
        """

    @abstractmethod
    def sign(self, message: Message) -> Sign: ...

    @abstractmethod
    def after_cancel(self, finish: Word) -> Word | None:
        """Return the performer's last message after CANCEL, or None to send none, as the original does.

        :param finish: the last message without CANCEL.
        """

    @abstractmethod
    def arguments_of(self, key: Key) -> tuple[str, ...]:
        """Return the intended arguments: some originals send one in place of none."""
