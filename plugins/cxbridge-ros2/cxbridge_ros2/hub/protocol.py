"""The messages on a hub, and the base class of its protocols.

The protocols of PlanSys2 and of ros2-clips-executive have the same kinds of messages in the same order. Their
topics, the names of some fields, and some rules differ.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from enum import IntEnum
from typing import Any, ClassVar, NamedTuple

from msgspec import Struct

from cxbridge_ros2.messages import Message


class MessageKind(IntEnum):
    """The kind of a message on a hub."""

    REQUEST = 1
    RESPONSE = 2
    CONFIRM = 3
    REJECT = 4
    FEEDBACK = 5
    FINISH = 6
    CANCEL = 7


class PerformerState(IntEnum):
    """The state that a performer publishes once a second."""

    NOT_READY = 0
    READY = 1
    RUNNING = 2
    FAILURE = 4


class ActionKey(NamedTuple):
    """The identity of a request: action and arguments.

    Hubs have no ids of requests, so that two requests for one action are indistinguishable.
    """

    action: str
    arguments: tuple[str, ...]

    def __str__(self) -> str:
        return f"({' '.join((self.action, *self.arguments))})"


class HubMessage(Struct, frozen=True):
    """A message on the hub.

    :param kind: a :class:`MessageKind`, or an unknown number.
    :param node: the name of the caller's node in a REQUEST, of the performer's node in other messages.
    :param key: the requested action.
    :param skill_string: the skill string that the caller's action mapping gives; may be empty.
    :param success: the result in a FINISH.
    :param progress: the progress from 0 to 1, in FEEDBACK and FINISH.
    :param status: the current work or the error, in FEEDBACK and FINISH.
    """

    kind: int
    node: str
    key: ActionKey
    skill_string: str = ""
    success: bool = False
    progress: float = 0.0
    status: str = ""


class Heartbeat(Struct, frozen=True):
    """A heartbeat of a performer.

    :param state: a :class:`PerformerState`, or an unknown number.
    """

    node: str
    action: str
    state: int


class HubProtocol(ABC):
    """A protocol: its topics, the fields of its messages, and its rules.

    :cvar name: the name in a configuration.
    :cvar topic: the topic of the hub.
    :cvar arguments_field: the field with the arguments of the action.
    :cvar progress_field: the field with the progress.
    :cvar server_timeout_s: the time without a RESPONSE after which the original caller gives up.
    :cvar request_lifetime_s: the time after which the original caller repeats a REQUEST or gives up, so that
        a later RESPONSE is useless.
    :cvar has_skill_strings: whether messages have a skill string.
    """

    name: ClassVar[str]
    topic: ClassVar[str]
    message_type: ClassVar[str]
    heartbeat_topic: ClassVar[str]
    heartbeat_type: ClassVar[str]
    arguments_field: ClassVar[str]
    progress_field: ClassVar[str]
    server_timeout_s: ClassVar[float]
    request_lifetime_s: ClassVar[float]
    has_skill_strings: ClassVar[bool] = False

    def encode(self, message: HubMessage) -> Mapping[str, Any]:
        fields = {
            "type": message.kind,
            "node_id": message.node,
            "action": message.key.action,
            self.arguments_field: list(message.key.arguments),
            "success": message.success,
            self.progress_field: message.progress,
            "status": message.status,
        }
        if self.has_skill_strings:
            fields["mapped_action"] = message.skill_string
        return fields

    def decode(self, fields: Message) -> HubMessage:
        return HubMessage(
            kind=fields["type"],
            node=fields["node_id"],
            key=ActionKey(fields["action"], tuple(fields[self.arguments_field])),
            skill_string=fields.get("mapped_action", ""),
            success=fields["success"],
            progress=fields[self.progress_field],
            status=fields["status"],
        )

    @abstractmethod
    def encode_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> Mapping[str, Any]:
        """Return the message for a heartbeat.

        :param now_us: microseconds since the epoch.
        """

    @abstractmethod
    def decode_heartbeat(self, fields: Message) -> Heartbeat: ...

    @abstractmethod
    def make_cancel_reply(self, finish: HubMessage) -> HubMessage | None:
        """Return the last message of a performer after a CANCEL, or None for no message.

        :param finish: the last message of a performer without a CANCEL.
        """

    @abstractmethod
    def intended_arguments(self, key: ActionKey) -> tuple[str, ...]:
        """Return the arguments that the caller means: an action without arguments has a placeholder."""
