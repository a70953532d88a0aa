"""Conversion of the messages in a bag to events of a run, by topic and type.

A bag that cxbridge has written has the events of the run as JSON on topics of cxbridge. A robot's bag has
other topics: the status of actions and the messages on hubs (the topics on which PlanSys2 and
ros2-clips-executive request actions) become skills, /rosout becomes the log, /tf and topics of interfaces
become interface writes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import msgspec

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.events import Event, InterfaceWrite, LogLine, SkillStatus
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import FieldSchema
from cxbridge.trace.codec import dump_json, make_decoder
from cxbridge.trace.formats.base import Attachment, StoredFile
from cxbridge_ros2.actions import STATUS_TYPE, GoalStatus
from cxbridge_ros2.frames import ROS_ID_PREFIX, TF_MESSAGE_TYPE, decode_transform
from cxbridge_ros2.hub.protocol import MessageKind
from cxbridge_ros2.interfaces.definitions import make_ros_field_names, make_ros_message_type
from cxbridge_ros2.messages import Message
from cxbridge_ros2.rosout import LOG_TYPE, find_level

EVENTS_TOPIC: Final = "/cxbridge/events"  # has the events of a run except `SourceRead`, as JSON with the kind
FILES_TOPIC: Final = "/cxbridge/files"  # has the files attached to a run, each as JSON
SOURCES_TOPIC: Final = "/cxbridge/sources"  # has a record of each `SourceRead`, a file that the run has read
TEXT_TYPE: Final = "std_msgs/msg/String"

_HUB_TYPES: Final = ("plansys2_msgs/msg/ActionExecution", "cx_msgs/msg/SkillExecution")
_GOAL_EVENT_SUFFIX: Final = "_SendGoal_Event"  # the end of the type of the events about goals' requests
_SKILL_STATUSES: Final = {
    GoalStatus.ACCEPTED: "S_RUNNING",
    GoalStatus.EXECUTING: "S_RUNNING",
    GoalStatus.SUCCEEDED: "S_FINAL",
    GoalStatus.CANCELED: "S_FAILED",
    GoalStatus.ABORTED: "S_FAILED",
}
_REQUEST_EVENTS: Final = (0, 1)  # REQUEST_SENT, REQUEST_RECEIVED of service_msgs/ServiceEventInfo
_INTERFACE_SLASH_COUNT: Final = 3  # the slashes in /blackboard/TYPE/ID: other topics do not tell the id
_MAX_GOALS: Final = 1000  # limits the memory for a long recording: the oldest goals are forgotten
# Limit of the characters of a skill string's arguments, chosen freely: a goal may be as large as any message,
# and each event of the goal repeats the skill string.
_MAX_ARGUMENTS_LENGTH: Final = 200

# Converts a message to events; called with the topic, the message, and the time in microseconds.
Converter = Callable[[str, Message, int], Iterator[Event]]


class ConverterTable:
    """The converters of the messages in a bag.

    :param registry: the interface types.
    :param has_events: whether the bag has the events of a run, which its other topics only repeat.
    """

    def __init__(self, registry: InterfaceRegistry, *, has_events: bool) -> None:
        self._registry = registry
        self._interfaces_by_message_type = (
            {} if has_events else {make_ros_message_type(name): name for name in registry.names()}
        )
        self._has_events = has_events
        self._goals: dict[bytes, _Goal] = {}  # by the id of an action's goal, or by a key for a hub
        self._last_number = 0
        self._converters_by_type: dict[str, Converter] = {
            LOG_TYPE: _convert_log,
            TF_MESSAGE_TYPE: self._convert_transforms,
            STATUS_TYPE: self._convert_status,
            **dict.fromkeys(_HUB_TYPES, self._convert_hub_message),
        }

    def find_converter(self, topic: str, message_type: str) -> Converter | None:
        """Return the converter for messages of a topic; None if the messages become no events."""
        if topic == EVENTS_TOPIC and message_type == TEXT_TYPE:
            return _convert_event
        if self._has_events:
            return None
        if message_type in self._interfaces_by_message_type and topic.count("/") == _INTERFACE_SLASH_COUNT:
            return self._make_interface_converter(self._interfaces_by_message_type[message_type])
        if message_type.endswith(_GOAL_EVENT_SUFFIX):
            return self._convert_goal_request
        return self._converters_by_type.get(message_type)

    # -- skills

    def _convert_goal_request(self, topic: str, message: Message, _time_us: int) -> Iterator[Event]:
        """Store the skill string of a goal, from the service event of its request."""
        for request in message["request"]:
            if message["info"]["event_type"] in _REQUEST_EVENTS:
                goal = self._ensure_goal(topic, request["goal_id"]["uuid"])
                goal.skill_string = _format_skill_string(goal.name, _flatten_fields(request["goal"]))
        yield from ()  # makes this function a generator like all converters; a request becomes no event

    def _convert_status(self, topic: str, message: Message, time_us: int) -> Iterator[Event]:
        for goal_status in message["status_list"]:
            goal = self._ensure_goal(topic, goal_status["goal_info"]["goal_id"]["uuid"])
            status = _SKILL_STATUSES.get(goal_status["status"])
            # each message repeats the statuses of earlier goals
            if status is not None and status != goal.status and goal.status in ("", "S_RUNNING"):
                goal.status = status
                yield SkillStatus(time_us, "", goal.action, goal.skill_string, goal.number, status)

    def _ensure_goal(self, topic: str, uuid: bytes) -> _Goal:
        if uuid not in self._goals:
            action = topic.partition("/_action/")[0]
            name = action.rpartition("/")[2]
            self._add_goal(uuid, action, name, _format_skill_string(name, {}))
        return self._goals[uuid]

    def _add_goal(self, key: bytes, action: str, name: str, skill_string: str) -> _Goal:
        while len(self._goals) >= _MAX_GOALS:
            del self._goals[next(iter(self._goals))]
        self._last_number += 1
        self._goals[key] = goal = _Goal(action, name, skill_string, self._last_number)
        return goal

    def _convert_hub_message(self, topic: str, message: Message, time_us: int) -> Iterator[Event]:
        # PlanSys2 and ros2-clips-executive have different names for the field
        arguments = message.get("arguments") or message.get("action_parameters") or ()
        skill_string = message.get("mapped_action") or _format_skill_string(
            message["action"], {str(number): value for number, value in enumerate(arguments, start=1)}
        )
        # messages on a hub have no id of the goal: topic, performer and skill string identify the goal
        goal_key = f"{topic} {message['node_id']} {skill_string}".encode()
        if message["type"] == MessageKind.CONFIRM:
            confirmed_goal = self._add_goal(goal_key, message["node_id"], "", skill_string)
            yield SkillStatus(
                time_us, "", message["node_id"], skill_string, confirmed_goal.number, "S_RUNNING"
            )
        elif message["type"] == MessageKind.FINISH and (goal := self._goals.pop(goal_key, None)) is not None:
            status = "S_FINAL" if message["success"] else "S_FAILED"
            yield SkillStatus(time_us, "", goal.action, skill_string, goal.number, status)

    # -- interfaces

    def _make_interface_converter(self, interface_type: str) -> Converter:
        fields = self._registry.schema(interface_type).fields
        ros_names = make_ros_field_names(fields)

        def convert(topic: str, message: Message, time_us: int) -> Iterator[Event]:
            values = {
                field.name: _to_interface_value(field, message[ros_names[field.name]]) for field in fields
            }
            yield InterfaceWrite(time_us, f"{interface_type}::{topic.rpartition('/')[2]}", values)

        return convert

    def _convert_transforms(self, topic: str, message: Message, time_us: int) -> Iterator[Event]:
        for message_transform in message["transforms"]:
            stamped = decode_transform(message_transform)
            values = {
                "static_transform": topic.endswith("_static"),
                "frame": stamped.frame,
                "child_frame": stamped.child_frame,
                "translation": stamped.transform.translation,
                "rotation": stamped.transform.rotation,
            }
            yield InterfaceWrite(time_us, f"TransformInterface::{ROS_ID_PREFIX}{stamped.child_frame}", values)


class _Goal(msgspec.Struct):
    """A goal of an action, or an action on a hub.

    :param action: the name of the action, or of the performer on a hub; stands for the Skiller in events.
    :param name: the last part of the action's name; stands for the skill. Empty for an action on a hub.
    :param skill_string: the skill string in events.
    :param number: the number of the goal in the bag; stands for the id of the message to the Skiller.
    :param status: the last reported status; empty before the first status.
    """

    action: str
    name: str
    skill_string: str
    number: int
    status: str = ""


def _convert_log(_topic: str, message: Message, time_us: int) -> Iterator[Event]:
    yield LogLine(time_us, find_level(message["level"]), message["name"], message["msg"])


def _convert_event(_topic: str, message: Message, _time_us: int) -> Iterator[Event]:
    # events of unknown kinds are left out: a later version of cxbridge may have more kinds
    event_json = message["data"].encode("utf-8", "surrogatepass")
    kind = msgspec.json.decode(event_json, type=_EventKind).kind
    if kind in EVENT_TYPES:
        yield make_decoder(EVENT_TYPES[kind])(event_json)


class _EventKind(msgspec.Struct):
    kind: str


def encode_record(record: Mapping[str, str]) -> Message:
    return {"data": dump_json(record)}


def decode_record(message: Message) -> Mapping[str, str]:
    """Return the record in a message.

    :raises ValueError: if the message has no record.
    """
    return msgspec.json.decode(message["data"], type=dict[str, str])


def encode_file(attachment: Attachment) -> Message:
    return {"data": msgspec.json.encode(attachment).decode()}  # with the bytes of the file in Base64


def decode_file(message: Message) -> StoredFile:
    """Return the file in a message.

    :raises ValueError: if the message has no file.
    """
    file = msgspec.json.decode(message["data"], type=Attachment)
    return StoredFile(file.name, file.media_type, len(file.data), file.time_us, lambda: file.data)


def _to_interface_value(field: FieldSchema, value: Any) -> Any:
    """Return the value of a field as in events of interface writes."""
    if field.enum is not None and not field.is_array:
        return next((item.name for item in field.enum.items if item.value == value), value)
    return tuple(value) if isinstance(value, bytes | list) else value


def _flatten_fields(value: Any, path: str = "") -> dict[str, Any]:
    """Return the scalars in a message by dotted path, without false, zeros and empty texts."""
    if isinstance(value, Mapping):
        flat_values: dict[str, Any] = {}
        for name, inner_value in value.items():
            flat_values.update(_flatten_fields(inner_value, f"{path}.{name}" if path else name))
        return flat_values
    is_scalar = isinstance(value, str | bool | int | float)
    return {path: value} if is_scalar and value else {}


def _format_skill_string(name: str, values: Mapping[str, Any]) -> str:
    """Return a skill string, with long arguments cut."""
    arguments = ", ".join(f"{key}={msgspec.json.encode(value).decode()}" for key, value in values.items())
    ellipsis = "..." if len(arguments) > _MAX_ARGUMENTS_LENGTH else ""
    return f"{name}{{{arguments[:_MAX_ARGUMENTS_LENGTH]}{ellipsis}}}"
