"""Messages of ROS 2 in CDR, the encoding of DDS: malformed messages of well-known types."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Any, Final

from cxbridge.errors import Ros2Error
from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Codec
from cxbridge_ros2.names import TypeName, parse_type

TYPES: Final = (
    "std_msgs/msg/String",
    "std_msgs/msg/UInt8MultiArray",
    "geometry_msgs/msg/PoseWithCovarianceStamped",
    "sensor_msgs/msg/JointState",
    "nav_msgs/msg/Path",
    "tf2_msgs/msg/TFMessage",
    "action_msgs/msg/GoalStatusArray",
    "rcl_interfaces/msg/ParameterEvent",
    "plansys2_msgs/msg/ActionExecution",
    "cx_msgs/msg/SkillExecution",
)
"""The types; the first byte of an input is the index of its type, modulo the number of types."""


@cache
def _codec_and_types() -> tuple[Codec, tuple[TypeName, ...]]:
    return Codec(Definitions(environment={})), tuple(map(parse_type, TYPES))


def ros2_cdr(data: bytes) -> None:
    """Decode a message; an accepted message must survive encoding and decoding.

    :param data: the byte that selects the type, and CDR with its header.
    """
    codec, types = _codec_and_types()
    if not data:
        return
    type_name = types[data[0] % len(types)]
    try:
        message = codec.decode(type_name, data[1:])
    except Ros2Error:
        return
    try:
        encoded = codec.encode(type_name, message)
    except Ros2Error as error:
        if "NUL" in error.message:
            return  # foreign strings may contain NUL, encoded strings must not
        raise AssertionError(f"{type_name}: {error}") from error
    assert codec.encode(type_name, codec.decode(type_name, encoded)) == encoded, type_name


def cdr_seeds() -> Iterator[bytes]:
    """Yield an empty message of each type, and messages with values of five types."""
    codec, types = _codec_and_types()
    for index, type_name in enumerate(types):
        yield bytes([index]) + codec.encode(type_name, {})
    filled_messages: dict[str, dict[str, Any]] = {
        "std_msgs/msg/String": {"data": "äö"},
        "sensor_msgs/msg/JointState": {"name": ["a", "b"], "position": [1.0, -2.0]},
        "tf2_msgs/msg/TFMessage": {"transforms": [{"child_frame_id": "base"}, {}]},
        "rcl_interfaces/msg/ParameterEvent": {"new_parameters": [{"name": "x", "value": {"type": 4}}]},
        "cx_msgs/msg/SkillExecution": {"action": "move", "action_parameters": ["r", "a"]},
    }
    for type_text, message in filled_messages.items():
        yield bytes([TYPES.index(type_text)]) + codec.encode(parse_type(type_text), message)
