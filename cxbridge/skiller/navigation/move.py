"""The executor that moves a simulated robot between places."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import Any

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import ConfigError, SkillError
from cxbridge.skiller.board.executor import ExecutorContext, Progress, SkillExecutor, Steps
from cxbridge.skiller.board.protocol import SkillCall
from cxbridge.skiller.navigation.base import Base
from cxbridge.space.navgraph import NavGraphNode, emit_navgraph, load_navgraph
from cxbridge.space.navgraph.graph import property_as_float
from cxbridge.space.tf.geometry import quaternion_from_yaw

DEFAULT_SPEED = 0.22
"""The default speed in metres per second, that of a TurtleBot3 Burger."""

DEFAULT_TURN_SPEED = 2.84
"""The default speed of turning in radians per second, that of a TurtleBot3 Burger."""

_TOLERANCE = 1e-6  # metres, or radians; far above the rounding errors of a base


class Move(SkillExecutor):
    """Executes ``move{to="wp1"}`` and ``goto{place="wp1"}``; docs/skill-board.md lists the settings."""

    skills = ("move", "goto")
    known_settings = ("navgraph", "start", "speed", "turn", "pose", "frame")

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        # in a graph of several parts, only the call for an unreachable place fails
        self.graph = load_navgraph(self.folder / str(self.setting("navgraph")), allow_multi_graph=True)
        if not self.graph.nodes:
            raise ConfigError("the navgraph has no nodes", file=self.folder / str(self.setting("navgraph")))
        speed, turn_speed = self.setting("speed", DEFAULT_SPEED), self.setting("turn", DEFAULT_TURN_SPEED)
        for name, value in (("speed", speed), ("turn", turn_speed)):
            if not 0 < value < math.inf:
                raise ConfigError(f"a robot's {name} must be above 0, not {value:g}")
        start_node = self._find_node(self.setting("start", self.graph.nodes[0].name))
        self.base = Base(start_node.x, start_node.y, _read_orientation(start_node) or 0.0, speed, turn_speed)
        self._last_us = self.clock.now_us()
        self._update_count = 0
        # the class of the interface is made from XML at run time, so it has no static type
        self._pose: Any = None

    def start(self) -> None:
        """Publish the pose and emit the graph."""
        emit_navgraph(self.log.bus, self.graph)
        self._pose = self.board.open_for_writing(
            "Position3DInterface", self.setting("pose", f"Pose-{self.agent}"), owner=f"{self.agent}, move"
        )
        self._pose.frame = self.setting("frame", "map")
        self._publish()

    def close(self) -> None:
        if self._pose is not None:
            self._pose.close()

    def idle(self) -> None:
        """Publish the pose while standing still."""
        self._last_us = self.clock.now_us()
        self._publish()

    def execute(self, call: SkillCall) -> Steps:
        """Drive to the nearest place, then along the path to the target, and turn to its orientation.

        :raises SkillError: if the place is missing in the call, unknown, or unreachable.
        """
        target = self._find_node(call.text("to" if call.skill == "move" else "place"))
        path = self._find_path(target)
        length, spare_s = self._path_length(path), 0.0
        self._last_us = self.clock.now_us()
        for index, node in enumerate(path):
            spare_s = self.base.approach(node.x, node.y, spare_s)
            # one step per loop; the rest of the time of a step is used for the next node
            while self._distance(node) > _TOLERANCE:
                self._publish()
                yield Progress(1 - self._path_length(path[index:]) / length, f"to {node.name}")
                spare_s = self.base.approach(node.x, node.y, self._elapsed_s())
        orientation = _read_orientation(target)
        if orientation is not None:
            self.base.turn_to(orientation, spare_s)
            while abs(math.remainder(orientation - self.base.yaw, math.tau)) > _TOLERANCE:
                self._publish()
                yield Progress(1.0, f"turning at {target.name}")
                self.base.turn_to(orientation, self._elapsed_s())
        self._publish()

    def _find_node(self, name: str) -> NavGraphNode:
        """Return the node of a place.

        :raises SkillError: if there is no such place.
        """
        node = self.graph.node(name)
        if node is None:
            names = ", ".join(node.name for node in self.graph.nodes)
            raise SkillError(f"there is no place '{name}'", hint=f"there are: {names}")
        return node

    def _find_path(self, target: NavGraphNode) -> list[NavGraphNode]:
        """Return the path to a place, nearest place first; in a graph without edges only the target.

        :raises SkillError: if no path leads there.
        """
        if not self.graph.edges:
            return [target]
        nearest = self.graph.closest_node(self.base.x, self.base.y)
        path = None if nearest is None else self.graph.search_path(nearest.name, target.name)
        if path is None:
            raise SkillError(f"there is no path to {target.name}")
        return list(path.nodes)

    def _distance(self, node: NavGraphNode) -> float:
        """Return the distance of a place in metres."""
        return node.distance(self.base.x, self.base.y)

    def _path_length(self, path: list[NavGraphNode]) -> float:
        """Return the length of a path from the present pose in metres."""
        return self._distance(path[0]) + sum(start.distance(end.x, end.y) for start, end in pairwise(path))

    def _elapsed_s(self) -> float:
        """Return the seconds since the last call."""
        last_us, self._last_us = self._last_us, self.clock.now_us()
        return max(0, self._last_us - last_us) / MICROSECONDS

    def _publish(self) -> None:
        """Write the pose."""
        pose = self._pose
        # the field has 31 bits, and a simulation may run for years
        self._update_count = min(self._update_count + 1, 2**31 - 1)
        pose.visibility_history = self._update_count
        pose.translation = (self.base.x, self.base.y, 0.0)
        pose.rotation = quaternion_from_yaw(self.base.yaw)
        pose.write()


def _read_orientation(node: NavGraphNode) -> float | None:
    """Return the required orientation at a place in radians; None: any."""
    text = node.properties.get("orientation")
    return None if text is None else property_as_float(text)
