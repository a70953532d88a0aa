"""Conversion of events to messages for Foxglove's panels; docs/evidence/web-page.md lists the topics."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from cxbridge.events import Event, InterfaceWrite, Level, LogLine, NavGraphRead
from cxbridge.trace.codec import dump_json
from cxbridge_web.foxglove.message_parts import (
    is_number,
    make_navgraph_scene,
    make_pose,
    make_quaternion,
    make_time,
    make_vector,
)

# The topic of the log. Readers of runs skip the topics below `/foxglove`, which repeat recorded events.
LOG_TOPIC: Final = "/foxglove/log"

TRANSFORM_TOPIC: Final = "/foxglove/tf"

# Foxglove's numbers of the levels.
LEVELS: Final = {Level.DEBUG: 1, Level.INFO: 2, Level.WARN: 3, Level.ERROR: 4}

# The frame of a navigator that names none. The skill motor_move of the Robotino has the same default.
_DEFAULT_FRAME: Final = "odom"

_TRANSLATION_LENGTH: Final = 3  # x, y, z
_ROTATION_LENGTH: Final = 4  # a quaternion


@dataclass(frozen=True, slots=True)
class FoxgloveMessage:
    """A message on a topic below ``/foxglove``.

    :param schema_name: the name of the schema without ``foxglove.``.
    :param data: the members of the message as JSON values.
    :param subject: the subject of a state that is valid until the next message with this subject; empty for a
        momentary message.
    """

    topic: str
    schema_name: str
    data: Mapping[str, Any]
    subject: str = ""

    def encode(self) -> bytes:
        """Return the message as JSON in UTF-8."""
        # a lone surrogate, which UTF-8 cannot encode, becomes its JSON escape, such as \udc80
        return dump_json(self.data).encode("utf-8", "backslashreplace")


def make_foxglove_messages(event: Event) -> Iterator[FoxgloveMessage]:
    """Yield the messages for an event. Most kinds of events have none."""
    if isinstance(event, LogLine):
        yield _make_log_message(event)
    elif isinstance(event, NavGraphRead):
        yield FoxgloveMessage(
            f"/foxglove/navgraph/{event.graph}", "SceneUpdate", make_navgraph_scene(event), event.graph
        )
    elif isinstance(event, InterfaceWrite):
        make_message = _MESSAGE_MAKERS.get(event.uid.partition("::")[0])
        message = None if make_message is None else make_message(event)
        if message is not None:
            yield message


def _make_log_message(event: LogLine) -> FoxgloveMessage:
    line = {
        "timestamp": make_time(event.time_us),
        "level": LEVELS[event.level],
        "message": event.text,
        "name": event.component,
        "file": "",
        "line": 0,
    }
    return FoxgloveMessage(LOG_TOPIC, "Log", line)


def _make_position_message(event: InterfaceWrite) -> FoxgloveMessage | None:
    frame, translation = _read_frame(event, "frame"), _read_numbers(event, "translation", _TRANSLATION_LENGTH)
    rotation = _read_numbers(event, "rotation", _ROTATION_LENGTH)
    if not frame or translation is None or rotation is None:
        return None  # a writer that has not written a pose yet leaves the frame empty
    return _make_pose_message(event, frame, make_pose(translation, rotation))


def _make_navigator_message(event: InterfaceWrite) -> FoxgloveMessage | None:
    """Return the robot's position according to a navigator; None without finite coordinates."""
    x, y = event.values.get("x"), event.values.get("y")
    if not is_number(x) or not is_number(y):
        return None
    frame = _read_frame(event, "target_frame") or _DEFAULT_FRAME
    return _make_pose_message(event, frame, make_pose((x, y, 0.0)))


def _make_pose_message(event: InterfaceWrite, frame: str, pose: dict[str, Any]) -> FoxgloveMessage:
    # TYPE::ID becomes TYPE/ID; an id may begin with a slash itself
    topic = "/foxglove/pose/" + event.uid.replace("::", "/", 1).replace("//", "/")
    data = {"timestamp": make_time(event.time_us), "frame_id": frame, "pose": pose}
    return FoxgloveMessage(topic, "PoseInFrame", data, event.uid)


def _make_transform_message(event: InterfaceWrite) -> FoxgloveMessage | None:
    parent, child = _read_frame(event, "frame"), _read_frame(event, "child_frame")
    translation = _read_numbers(event, "translation", _TRANSLATION_LENGTH)
    rotation = _read_numbers(event, "rotation", _ROTATION_LENGTH)
    if not parent or not child or translation is None or rotation is None:
        return None
    data = {
        "timestamp": make_time(event.time_us),
        "parent_frame_id": parent,
        "child_frame_id": child,
        "translation": make_vector(translation),
        "rotation": make_quaternion(rotation),
    }
    return FoxgloveMessage(TRANSFORM_TOPIC, "FrameTransform", data, child)


# The functions that make the messages, by the types of interfaces.
_MESSAGE_MAKERS: Final[dict[str, Callable[[InterfaceWrite], FoxgloveMessage | None]]] = {
    "Position3DInterface": _make_position_message,
    "TransformInterface": _make_transform_message,
    "NavigatorInterface": _make_navigator_message,
}


def _read_frame(event: InterfaceWrite, name: str) -> str:
    """Return a frame's name without a leading slash, which tf ignores; empty without a frame."""
    return str(event.values.get(name, "")).lstrip("/")


def _read_numbers(event: InterfaceWrite, name: str, count: int) -> tuple[float, ...] | None:
    """Return a field of ``count`` finite numbers; None for other values, since JSON has no NaN."""
    value = event.values.get(name)
    if not isinstance(value, list | tuple) or len(value) != count or not all(map(is_number, value)):
        return None
    return tuple(value)
