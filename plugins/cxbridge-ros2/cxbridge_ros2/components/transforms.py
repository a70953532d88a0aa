"""The component that writes transforms from /tf and /tf_static as TransformInterfaces."""

from __future__ import annotations

from functools import partial
from typing import Final

from cxbridge.errors import CxbridgeError, InterfaceError
from cxbridge.mainloop import Hook
from cxbridge.rights import right_of_frame
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge.space.tf import TransformPublisher
from cxbridge_ros2.frames import ROS_ID_PREFIX, TF_MESSAGE_TYPE, FrameSender, decode_transform
from cxbridge_ros2.messages import Message
from cxbridge_ros2.qos import PROFILES
from cxbridge_ros2.settings import locate_errors, read_node_section, typed_setting

_SECTION: Final = "/ros2/tf"
MAX_FRAMES: Final = 500  # limit of frames: a stranger may send any number of names

_ALL: Final = "all"
_KEYS: Final = ("frames", "publish")
_TOPICS: Final = (("/tf", "tf", False), ("/tf_static", "tf_static", True))
_COMPONENT: Final = "the settings of /tf"


class Ros2Transforms(Component):
    """Makes the frames of ROS 2 available to rules and skills."""

    hooks = (Hook.SENSOR_ACQUIRE,)
    description = "Coordinate frames of ROS 2"

    def __init__(self, context: Run) -> None:
        self._board, self._log = context.board, context.bus.logger("Ros2Transforms")
        values, settings = read_node_section(
            context.config, _SECTION, _KEYS, context.paths.confdir, _COMPONENT
        )
        with locate_errors(context.config, _SECTION):
            is_publishing = typed_setting(values, "publish", default=False, component=_COMPONENT)
        frames = values.get("frames", _ALL)
        self._selected = None if frames == _ALL else frozenset(map(str, frames))
        self._publishers: dict[str, TransformPublisher] = {}
        self._refused: set[str] = set()
        self._node = node = settings.join(
            f"cxbridge_tf_{context.name}", settings.load_definitions(), self._log.warn, context.rights
        )
        for topic, profile, static in _TOPICS:
            receive, right = partial(self._receive, static=static), right_of_frame("ros2-tf", topic)
            node.subscribe(topic, TF_MESSAGE_TYPE, receive, PROFILES[profile], right=right)
        self._sender = FrameSender(node, context.board) if is_publishing else None

    def loop(self) -> None:
        self._node.poll()
        if self._sender is not None:
            self._sender.publish_changes()

    def _receive(self, message: Message, *, static: bool) -> None:
        for transform in message["transforms"]:
            # as in tf2, a leading slash, which old nodes write, is no part of the frame's name
            child = transform["child_frame_id"].lstrip("/")
            if child in self._refused or (self._selected is not None and child not in self._selected):
                continue
            try:
                self._publisher(child).send(decode_transform(transform), static=static)
            except CxbridgeError as error:
                self._refuse(child, error.message)

    def _publisher(self, child: str) -> TransformPublisher:
        if child not in self._publishers:
            if len(self._publishers) >= MAX_FRAMES:
                raise InterfaceError(f"there are {MAX_FRAMES} frames already")
            publisher = TransformPublisher(self._board, f"{ROS_ID_PREFIX}{child}", owner="ROS 2")
            self._publishers[child] = publisher
        return self._publishers[child]

    def _refuse(self, child: str, reason: str) -> None:
        """Log once why a frame is left out."""
        if len(self._refused) >= MAX_FRAMES:  # else any number of names would fill the log and the memory
            return
        self._refused.add(child)
        self._log.warn(f"The frame '{child}' of ROS 2 is left out: {reason}")

    def close(self) -> None:
        if self._sender is not None:
            self._sender.close()
        self._node.close()
        for publisher in self._publishers.values():
            publisher.close()
