"""Coordinate frames as messages on /tf and /tf_static, and the publisher of the frames of the blackboard.

A frame is a TransformInterface; its ``static_transform`` is true for a frame that does not move.
"""

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
from cxbridge_ros2.stamps import stamp_to_us, us_to_stamp

TF_MESSAGE_TYPE: Final = "tf2_msgs/msg/TFMessage"
# each topic of frames, its QoS profile, and whether its frames are static
FRAME_TOPICS: Final = (("/tf", "tf", False), ("/tf_static", "tf_static", True))
ROS_ID_PREFIX: Final = "/tf/ros2/"  # precedes the ids of frames from ROS, which are not sent back

_INTERFACE_TYPE: Final = "TransformInterface"


def encode_transform(values: Mapping[str, Any], time_us: int) -> Message:
    """Return the values of a TransformInterface as a geometry_msgs/msg/TransformStamped."""
    return {
        "header": {"stamp": us_to_stamp(time_us), "frame_id": values["frame"]},
        "child_frame_id": values["child_frame"],
        "transform": {
            "translation": dict(zip("xyz", map(float, values["translation"]), strict=True)),
            "rotation": dict(zip("xyzw", map(float, values["rotation"]), strict=True)),
        },
    }


def decode_transform(message: Message) -> StampedTransform:
    """Return the transform in a geometry_msgs/msg/TransformStamped."""
    header, transform = message["header"], message["transform"]
    translation, rotation = transform["translation"], transform["rotation"]
    return StampedTransform(
        Transform(
            (translation["x"], translation["y"], translation["z"]),
            (rotation["x"], rotation["y"], rotation["z"], rotation["w"]),
        ),
        stamp_to_us(header["stamp"]),
        # tf of ROS 1 began its names with a slash, and some old nodes still do
        header["frame_id"].lstrip("/"),
        message["child_frame_id"].lstrip("/"),
    )


class FramePublisher(Closing):
    """Publishes the existing and future frames of a blackboard, except those from ROS."""

    def __init__(self, node: Node, board: BlackBoard) -> None:
        self._moving_publisher = node.create_publisher("/tf", TF_MESSAGE_TYPE, PROFILES["tf"])
        self._static_publisher = node.create_publisher("/tf_static", TF_MESSAGE_TYPE, PROFILES["tf_static"])
        self._static_transforms: dict[str, Message] = {}
        self._feed = Feed(board, "ROS 2")
        for instance in self._feed.follow(_INTERFACE_TYPE, "*"):
            self._publish_change(self._feed.read_state(instance))

    def publish_changes(self) -> None:
        while (change := self._feed.wait_for_change(Deadline(0))) is not None:
            self._publish_change(change)

    def _publish_change(self, change: InterfaceChange) -> None:
        uid, values = change.uid, change.values
        if (
            uid.startswith(f"{_INTERFACE_TYPE}::{ROS_ID_PREFIX}")
            or change.kind != "data"
            or not values["child_frame"]  # the interface has not been written yet
        ):
            return
        message = encode_transform(values, change.time_us)
        if not values["static_transform"]:
            self._moving_publisher.publish({"transforms": [message]})
        elif self._static_transforms.get(uid) != message:
            # all static frames in each message, since a late subscription gets only the last message
            self._static_transforms[uid] = message
            self._static_publisher.publish({"transforms": list(self._static_transforms.values())})

    def close(self) -> None:
        self._feed.close()
