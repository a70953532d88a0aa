"""The messages on a hub, and the differences of its protocols.

The protocols of PlanSys2 and of the thesis have the same messages in the same order; their topics, some field
names and some habits differ.
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
    """The requested action. Hubs have no request ids, so two requests for one action are indistinguishable.

    :param agent: the robot; empty for a single robot.
    """

    action: str
    arguments: tuple[str, ...]
    agent: str

    def __str__(self) -> str:
        return f"({' '.join((self.action, *self.arguments))})"


class HubMessage(Struct, frozen=True):
    """A message on the hub.

    :param kind: a :class:`MessageKind`, or an unknown number.
    :param node: the caller's node in a REQUEST, else the performer's.
    :param key: the requested action.
    :param mapped: the skill string mapped to the action; may be empty.
    :param success: the result in a FINISH.
    :param progress: from 0 to 1, in FEEDBACK and FINISH.
    :param status: the current work or the error, in FEEDBACK and FINISH.
    """

    kind: int
    node: str
    key: ActionKey
    mapped: str = ""
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
    """A protocol: its topics, the fields of its messages, and its habits."""

    name: ClassVar[str]  # the protocol's name in a configuration

    topic: ClassVar[str]  # the topic of the hub

    message_type: ClassVar[str]

    heartbeat_topic: ClassVar[str]

    heartbeat_type: ClassVar[str]

    arguments_field: ClassVar[str]  # the field with the arguments of the action

    progress_field: ClassVar[str]

    # Seconds after which the original caller gives up the search for a performer.
    patience_s: ClassVar[float]

    # Seconds in which a response to a REQUEST is useful; then the REQUEST is repeated or given up.
    request_lifetime_s: ClassVar[float]

    has_agents: ClassVar[bool] = False  # whether messages name a robot and a mapped skill string

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
        if self.has_agents:
            fields |= {"agent_id": message.key.agent, "mapped_action": message.mapped}
        return fields

    def decode(self, fields: Message) -> HubMessage:
        arguments = tuple(fields[self.arguments_field])
        return HubMessage(
            kind=fields["type"],
            node=fields["node_id"],
            key=ActionKey(fields["action"], arguments, fields.get("agent_id", "")),
            mapped=fields.get("mapped_action", ""),
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
    def cancel_reply(self, finish: HubMessage) -> HubMessage | None:
        """Return the performer's last message after CANCEL, or None for no message, as in the original.

        :param finish: the last message without CANCEL.
        """

    @abstractmethod
    def intended_arguments(self, key: ActionKey) -> tuple[str, ...]:
        """Return the intended arguments: the original callers send a placeholder for no argument."""
