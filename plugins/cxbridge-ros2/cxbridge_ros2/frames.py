"""Publishes the blackboard's coordinate frames: TransformInterfaces go to /tf and /tf_static."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.following import Deadline, Feed, InterfaceChange
from cxbridge.closing import Closing
from cxbridge.space.tf.buffer import StampedTransform
from cxbridge.space.tf.geometry import Transform
from cxbridge_ros2.messages import Message
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.stamps import microseconds_of, stamp_of

TRANSFORMS: Final = "tf2_msgs/msg/TFMessage"
FROM_ROS: Final = "/tf/ros2/"  # id prefix of frames from ROS, which are not sent back

_TYPE: Final = "TransformInterface"


def transform_message(values: Mapping[str, Any], time_us: int) -> Message:
    """Return a TransformInterface's values as a geometry_msgs/msg/TransformStamped."""
    return {
        "header": {"stamp": stamp_of(time_us), "frame_id": values["frame"]},
        "child_frame_id": values["child_frame"],
        "transform": {
            "translation": dict(zip("xyz", map(float, values["translation"]), strict=True)),
            "rotation": dict(zip("xyzw", map(float, values["rotation"]), strict=True)),
        },
    }


def stamped_transform(message: Message) -> StampedTransform:
    """Return the values of a geometry_msgs/msg/TransformStamped."""
    header, transform = message["header"], message["transform"]
    translation, rotation = transform["translation"], transform["rotation"]
    return StampedTransform(
        Transform(
            (translation["x"], translation["y"], translation["z"]),
            (rotation["x"], rotation["y"], rotation["z"], rotation["w"]),
        ),
        microseconds_of(header["stamp"]),
        # tf of ROS 1 began its names with a slash, and some old nodes still do
        header["frame_id"].lstrip("/"),
        message["child_frame_id"].lstrip("/"),
    )


class FrameSender(Closing):
    """Sends the existing and future frames of a blackboard."""

    def __init__(self, node: Node, board: BlackBoard) -> None:
        self._moving = node.publisher("/tf", TRANSFORMS, PROFILES["tf"])
        self._static = node.publisher("/tf_static", TRANSFORMS, PROFILES["tf_static"])
        self._static_frames: dict[str, Message] = {}
        self._feed = Feed(board, "ROS 2")
        for instance in self._feed.follow(_TYPE, "*"):
            self._send(self._feed.now(instance))

    def loop(self) -> None:
        while (change := self._feed.next(Deadline(0))) is not None:
            self._send(change)

    def _send(self, change: InterfaceChange) -> None:
        uid, values = change.uid, change.values
        if uid.startswith(f"{_TYPE}::{FROM_ROS}") or change.kind != "data" or not values["child_frame"]:
            return
        message = transform_message(values, change.time_us)
        if not values["static_transform"]:
            self._moving.publish({"transforms": [message]})
        elif self._static_frames.get(uid) != message:
            # all static frames in each message, since a late subscription gets only the last message
            self._static_frames[uid] = message
            self._static.publish({"transforms": list(self._static_frames.values())})

    def close(self) -> None:
        self._feed.close()
        self._moving.close()
        self._static.close()
