"""Conversion of a bag's messages to events of a run, by message type.

A bag of cxbridge has all events of its run as JSON. A robot's bag has topics only: the status of actions and
the messages of hubs become skills, /rosout becomes the log, /tf and interface topics become interface writes.
"""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final

import msgspec

from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.events import Event, InterfaceWrite, Level, LogLine, SkillStatus
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import FieldSchema
from cxbridge.trace.codec import decoder, dump
from cxbridge.trace.formats.base import StoredFile
from cxbridge_ros2.actions import STATUS_TYPE, GoalStatus
from cxbridge_ros2.frames import ROS_ID_PREFIX, TF_MESSAGE_TYPE
from cxbridge_ros2.hub.protocol import MessageKind
from cxbridge_ros2.interfaces.definitions import field_names, type_of
from cxbridge_ros2.messages import Message
from cxbridge_ros2.rosout import LOG_TYPE, find_level

EVENTS: Final = "/cxbridge/events"  # topic with all events of a run, each as JSON with its kind

FILES: Final = "/cxbridge/files"  # topic with the files of a run, each as JSON

SOURCES: Final = "/cxbridge/sources"  # topic with the sources of a run, each as JSON

TEXT: Final = "std_msgs/msg/String"

_TREE: Final = "nav2_msgs/msg/BehaviorTreeLog"
_HUBS: Final = ("plansys2_msgs/msg/ActionExecution", "cx_msgs/msg/SkillExecution")
_GOAL_EVENT: Final = "_SendGoal_Event"
_STATUSES: Final = {
    GoalStatus.ACCEPTED: "S_RUNNING",
    GoalStatus.EXECUTING: "S_RUNNING",
    GoalStatus.SUCCEEDED: "S_FINAL",
    GoalStatus.CANCELED: "S_FAILED",
    GoalStatus.ABORTED: "S_FAILED",
}
_REQUEST_EVENTS: Final = (0, 1)  # REQUEST_SENT, REQUEST_RECEIVED of service_msgs/ServiceEventInfo
_INTERFACE_SLASHES: Final = 3  # number of slashes in /blackboard/TYPE/ID
_MAX_GOALS: Final = 1000  # a long recording has any number of goals: the oldest are forgotten
_MAX_ARGUMENTS: Final = 200  # characters of the arguments in a skill string

# Converts a message to events; called with the topic, the message, and the time in microseconds.
Converter = Callable[[str, Message, int], Iterator[Event]]


class Converters:
    """Converters of a bag's messages by type.

    :param registry: the interface types.
    :param has_events: whether the bag has all events of its run, so that its other topics only repeat them.
    """

    def __init__(self, registry: InterfaceRegistry, *, has_events: bool) -> None:
        self._registry = registry
        self._interfaces = {} if has_events else {type_of(name): name for name in registry.names()}
        self.has_events = has_events
        self._goals: dict[bytes, _Goal] = {}
        self._last_number = 0
        self._by_type: dict[str, Converter] = {
            LOG_TYPE: _log,
            TF_MESSAGE_TYPE: self._transforms,
            STATUS_TYPE: self._status,
            _TREE: _tree,
            **dict.fromkeys(_HUBS, self._hub),
        }

    def of(self, topic: str, message_type: str) -> Converter | None:
        if topic == EVENTS and message_type == TEXT:
            return _event
        if self.has_events:
            return None
        if message_type in self._interfaces and topic.count("/") == _INTERFACE_SLASHES:
            return self._interface(self._interfaces[message_type])
        if message_type.endswith(_GOAL_EVENT):
            return self._goal_request
        return self._by_type.get(message_type)

    # -- skills

    def _goal_request(self, topic: str, message: Message, _time_us: int) -> Iterator[Event]:
        """Keep the content of a goal from a service event."""
        for request in message["request"]:
            if message["info"]["event_type"] in _REQUEST_EVENTS:
                goal = self._goal(topic, request["goal_id"]["uuid"])
                goal.text = _skill_string(goal.name, _flatten(request["goal"]))
        yield from ()  # a generator like all converters, although a request is no event

    def _status(self, topic: str, message: Message, time_us: int) -> Iterator[Event]:
        for goal_status in message["status_list"]:
            goal = self._goal(topic, goal_status["goal_info"]["goal_id"]["uuid"])
            status = _STATUSES.get(goal_status["status"])
            # each message repeats the status of earlier goals
            if status is not None and status != goal.status and goal.status in ("", "S_RUNNING"):
                goal.status = status
                yield SkillStatus(time_us, "", goal.action, goal.text, goal.number, status)

    def _goal(self, topic: str, uuid: bytes) -> _Goal:
        if uuid not in self._goals:
            while len(self._goals) >= _MAX_GOALS:
                del self._goals[next(iter(self._goals))]
            self._last_number += 1
            action = topic.partition("/_action/")[0]
            name = action.rpartition("/")[2]
            self._goals[uuid] = _Goal(action, name, _skill_string(name, {}), self._last_number)
        return self._goals[uuid]

    def _hub(self, topic: str, message: Message, time_us: int) -> Iterator[Event]:
        # the field of PlanSys2, or that of the thesis
        arguments = message.get("arguments") or message.get("action_parameters") or ()
        text = message.get("mapped_action") or _skill_string(
            message["action"], {str(number): text for number, text in enumerate(arguments, start=1)}
        )
        key = f"{topic} {message['node_id']} {text}".encode()
        if message["type"] == MessageKind.CONFIRM:
            self._last_number += 1
            self._goals[key] = _Goal(message["node_id"], "", text, self._last_number)
            yield SkillStatus(time_us, "", message["node_id"], text, self._last_number, "S_RUNNING")
        elif message["type"] == MessageKind.FINISH and (goal := self._goals.pop(key, None)) is not None:
            status = "S_FINAL" if message["success"] else "S_FAILED"
            yield SkillStatus(time_us, "", goal.action, text, goal.number, status)

    # -- interfaces

    def _interface(self, interface_type: str) -> Converter:
        fields = self._registry.schema(interface_type).fields
        names = field_names(fields)

        def convert(topic: str, message: Message, time_us: int) -> Iterator[Event]:
            values = {field.name: _value(field, message[names[field.name]]) for field in fields}
            yield InterfaceWrite(time_us, f"{interface_type}::{topic.rpartition('/')[2]}", values)

        return convert

    def _transforms(self, topic: str, message: Message, time_us: int) -> Iterator[Event]:
        for stamped in message["transforms"]:
            # old nodes write a leading slash, as in ROS 1
            child, transform = stamped["child_frame_id"].lstrip("/"), stamped["transform"]
            values = {
                "static_transform": topic.endswith("_static"),
                "frame": stamped["header"]["frame_id"].lstrip("/"),
                "child_frame": child,
                "translation": tuple(transform["translation"].values()),
                "rotation": tuple(transform["rotation"].values()),
            }
            yield InterfaceWrite(time_us, f"TransformInterface::{ROS_ID_PREFIX}{child}", values)


class _Goal(msgspec.Struct):
    """A goal of an action, as far as the bag contains it."""

    action: str
    name: str
    text: str
    number: int
    status: str = ""


def _log(_topic: str, message: Message, time_us: int) -> Iterator[Event]:
    yield LogLine(time_us, find_level(message["level"]), message["name"], message["msg"])


def _tree(_topic: str, message: Message, time_us: int) -> Iterator[Event]:
    for change in message["event_log"]:
        yield LogLine(
            time_us,
            Level.DEBUG,
            "behavior tree",
            f"{change['node_name']}: {change['previous_status']} -> {change['current_status']}",
        )


def _event(_topic: str, message: Message, _time_us: int) -> Iterator[Event]:
    # kinds of later versions are left out
    data = message["data"].encode("utf-8", "surrogatepass")
    kind = msgspec.json.decode(data, type=_Kind).kind
    if kind in EVENT_TYPES:
        yield decoder(EVENT_TYPES[kind])(data)


class _Kind(msgspec.Struct):
    kind: str


class _File(msgspec.Struct):
    name: str
    media_type: str
    time_us: int
    data: str


def record_message(record: Mapping[str, str]) -> Message:
    return {"data": dump(record)}


def record_of(message: Message) -> Mapping[str, str]:
    """Return the record in a message.

    :raises ValueError: if the message has none.
    """
    return msgspec.json.decode(message["data"], type=dict[str, str])


def file_message(name: str, media_type: str, time_us: int, data: bytes) -> Message:
    text = base64.b64encode(data).decode()
    return {"data": msgspec.json.encode(_File(name, media_type, time_us, text)).decode()}


def file_of(message: Message) -> StoredFile:
    """Return the file in a message.

    :raises ValueError: if the message has none.
    """
    stored = msgspec.json.decode(message["data"], type=_File)
    data = base64.b64decode(stored.data, validate=True)
    return StoredFile(stored.name, stored.media_type, len(data), stored.time_us, lambda: data)


def _value(field: FieldSchema, value: Any) -> Any:
    """Return a value in the form of interface writes."""
    if field.enum is not None and not field.is_array:
        return next((item.name for item in field.enum.items if item.value == value), value)
    return tuple(value) if isinstance(value, bytes | list) else value


def _flatten(value: Any, path: str = "") -> dict[str, Any]:
    """Return the values of a message by dotted path, without empty texts and zeros."""
    if isinstance(value, Mapping):
        flat_values: dict[str, Any] = {}
        for name, inner in value.items():
            flat_values.update(_flatten(inner, f"{path}.{name}" if path else name))
        return flat_values
    is_scalar = isinstance(value, str | bool | int | float)
    return {path: value} if is_scalar and value else {}


def _skill_string(name: str, values: Mapping[str, Any]) -> str:
    """Return a skill string for display; long arguments are cut."""
    inner = ", ".join(f"{key}={msgspec.json.encode(value).decode()}" for key, value in values.items())
    return f"{name}{{{inner}}}" if len(inner) < _MAX_ARGUMENTS else f"{name}{{{inner[:_MAX_ARGUMENTS]}...}}"
