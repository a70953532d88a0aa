"""The component that exchanges coordinate frames between ROS 2 and the blackboard.

ROS 2 has frames on the topics /tf and /tf_static, the blackboard has a TransformInterface for each frame.
"""

from __future__ import annotations

from functools import partial
from typing import Final

from cxbridge.errors import CxbridgeError, InterfaceError
from cxbridge.mainloop import Hook
from cxbridge.rights import right_of_frame
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.space.tf import TransformPublisher
from cxbridge_ros2.frames import (
    FRAME_TOPICS,
    ROS_ID_PREFIX,
    TF_MESSAGE_TYPE,
    FramePublisher,
    decode_transform,
)
from cxbridge_ros2.messages import Message
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.settings import locate_errors, read_node_section, typed_setting

_SECTION: Final = "/ros2/tf"
MAX_FRAMES: Final = 500  # limit of frames from ROS, since other nodes may send any number

_ALL: Final = "all"
_KEYS: Final = ("frames", "publish")
_SUBJECT: Final = "the settings of /tf"


class Ros2Transforms(Component):
    """Writes the frames of ROS 2 to the blackboard for rules and skills.

    With ``publish: true`` in the configuration, also publishes the other frames of the blackboard.
    """

    hooks = (Hook.SENSOR_ACQUIRE,)
    description = "Coordinate frames of ROS 2"

    def __init__(self, context: Run) -> None:
        self._board, self._log = context.board, context.bus.logger("Ros2Transforms")
        values, settings = read_node_section(context.config, _SECTION, _KEYS, context.paths.confdir, _SUBJECT)
        with locate_errors(context.config, _SECTION):
            is_publishing = typed_setting(values, "publish", default=False, subject=_SUBJECT)
        frames = values.get("frames", _ALL)
        self._selected_frames = None if frames == _ALL else frozenset(map(str, frames))
        self._blackboard_publishers: dict[str, TransformPublisher] = {}
        self._refused_frames: set[str] = set()
        self._node = node = settings.join(
            f"cxbridge_tf_{context.name}", settings.load_definitions(), self._log.warn, context.rights
        )
        for topic, profile, is_static in FRAME_TOPICS:
            node.subscribe(
                topic,
                TF_MESSAGE_TYPE,
                partial(self._receive_transforms, is_static=is_static),
                PROFILES[profile],
                right=right_of_frame("ros2-tf", topic),
            )
        self._ros_publisher = FramePublisher(node, context.board) if is_publishing else None

    def loop(self) -> None:
        self._node.poll()
        if self._ros_publisher is not None:
            self._ros_publisher.publish_changes()

    def _receive_transforms(self, message: Message, *, is_static: bool) -> None:
        for transform in message["transforms"]:
            # tf of ROS 1 began the names of frames with a slash, and some old nodes still do
            child = transform["child_frame_id"].lstrip("/")
            if child in self._refused_frames or (
                self._selected_frames is not None and child not in self._selected_frames
            ):
                continue
            try:
                self._ensure_blackboard_publisher(child).send(decode_transform(transform), static=is_static)
            except CxbridgeError as error:
                self._refuse_frame(child, error.message)

    def _ensure_blackboard_publisher(self, child: str) -> TransformPublisher:
        """Return the publisher of a frame to the blackboard; the first call creates its interface.

        :raises InterfaceError: if there are :data:`MAX_FRAMES` frames already.
        """
        if child not in self._blackboard_publishers:
            if len(self._blackboard_publishers) >= MAX_FRAMES:
                raise InterfaceError(f"the limit of {MAX_FRAMES} frames is reached")
            publisher = TransformPublisher(self._board, f"{ROS_ID_PREFIX}{child}", owner="ROS 2")
            self._blackboard_publishers[child] = publisher
        return self._blackboard_publishers[child]

    def _refuse_frame(self, child: str, reason: str) -> None:
        """Log once why a frame is ignored."""
        if len(self._refused_frames) >= MAX_FRAMES:
            return  # other nodes may send any number of names, which would fill log and memory
        self._refused_frames.add(child)
        self._log.warn(f"The frame '{child}' of ROS 2 is ignored: {reason}")

    def close(self) -> None:
        if self._ros_publisher is not None:
            self._ros_publisher.close()
        self._node.close()
        for publisher in self._blackboard_publishers.values():
            publisher.close()
