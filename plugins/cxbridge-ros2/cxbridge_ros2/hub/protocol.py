"""The messages on a hub, and the description of its protocols.

The protocols of PlanSys2 and of ros2-clips-executive have the same kinds of messages in the same order. Their
topics, the names of some fields, and some rules differ.
"""

from __future__ import annotations

from collections.abc import Mapping
from enum import IntEnum
from typing import Any, NamedTuple

from msgspec import Struct
from msgspec.structs import replace

from cxbridge_ros2.messages import Message
from cxbridge_ros2.stamps import us_to_stamp


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
    """The state that a performer publishes once a second, with the numbers of PlanSys2, which has no 3."""

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


class HubProtocol(Struct, frozen=True):
    """A protocol: its topics, the fields of its messages, and its rules.

    :param name: the name in a configuration.
    :param topic: the topic of the hub.
    :param arguments_field: the field with the arguments of the action.
    :param progress_field: the field with the progress.
    :param heartbeat_action_field: the field of a heartbeat with the action.
    :param server_timeout_s: the time without a RESPONSE after which the caller in PlanSys2 or in
        ros2-clips-executive gives up.
    :param request_lifetime_s: the time after which that caller repeats a REQUEST or gives up, so that a later
        RESPONSE is useless.
    :param cancelled_status: the status in the FINISH of a cancelled action; None if there is no FINISH.
    :param empty_argument: the argument that the same caller sends in place of an empty list; None if that
        argument is the name of the action.
    :param has_skill_strings: whether messages have a skill string.
    :param has_heartbeat_stamps: whether heartbeats have a stamp.
    """

    name: str
    topic: str
    message_type: str
    heartbeat_topic: str
    heartbeat_type: str
    arguments_field: str
    progress_field: str
    heartbeat_action_field: str
    server_timeout_s: float
    request_lifetime_s: float
    cancelled_status: str | None
    empty_argument: str | None
    has_skill_strings: bool
    has_heartbeat_stamps: bool

    def encode(self, message: HubMessage) -> Mapping[str, Any]:
        skill_string = {"mapped_action": message.skill_string} if self.has_skill_strings else {}
        return {
            "type": message.kind,
            "node_id": message.node,
            "action": message.key.action,
            self.arguments_field: list(message.key.arguments),
            "success": message.success,
            self.progress_field: message.progress,
            "status": message.status,
            **skill_string,
        }

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

    def encode_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> Mapping[str, Any]:
        """Return the message for a heartbeat.

        :param now_us: microseconds since the epoch.
        """
        stamp = {"status_stamp": us_to_stamp(now_us)} if self.has_heartbeat_stamps else {}
        return {
            "state": heartbeat.state,
            self.heartbeat_action_field: heartbeat.action,
            "node_name": heartbeat.node,
            **stamp,
        }

    def decode_heartbeat(self, fields: Message) -> Heartbeat:
        return Heartbeat(fields["node_name"], fields[self.heartbeat_action_field], fields["state"])

    def make_cancel_reply(self, finish: HubMessage) -> HubMessage | None:
        """Return the last message of a performer after a CANCEL, or None for no message.

        :param finish: the last message of a performer without a CANCEL.
        """
        if self.cancelled_status is None:
            return None
        return finish if finish.success else replace(finish, status=self.cancelled_status, progress=0.0)

    def intended_arguments(self, key: ActionKey) -> tuple[str, ...]:
        """Return the arguments that the caller means, without the replacement of an empty list."""
        empty_argument = key.action if self.empty_argument is None else self.empty_argument
        return () if key.arguments == (empty_argument,) else key.arguments
