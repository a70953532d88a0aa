"""The duration of driving along the navigation graph, and the robot's pose."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cxbridge.skiller.simulation.deciders import Decider, Outcome
from cxbridge.skiller.simulation.estimators import (
    CONFIG_PREFIX,
    EstimatorProperty,
    EstimatorSettings,
    argument_text,
)
from cxbridge.skiller.skillstring import SkillStringCall
from cxbridge.space.navgraph import NavGraph
from cxbridge.space.navgraph.graph import NavGraphNode

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.config import Configuration

NAVGRAPH_PREFIX = f"{CONFIG_PREFIX}/navgraph"
"""The path of this estimator's configuration."""

OWNER = "NavGraphEstimator"
"""The owner of the pose."""

_AMCL_PREFIX = "/plugins/amcl"


@dataclass(frozen=True, slots=True)
class _Drive:
    """A driving skill with the nodes of its path."""

    call: SkillStringCall
    nodes: tuple[NavGraphNode, ...]

    def pose(self, metres: float) -> tuple[float, float, float]:
        """Return x, y and heading after a distance in metres."""
        heading = 0.0
        for start, end in zip(self.nodes, self.nodes[1:], strict=False):
            length = start.distance(end.x, end.y)
            # a path may visit a node twice: between equal points the heading stays
            heading = math.atan2(end.y - start.y, end.x - start.x) if length else heading
            if metres < length:
                share = metres / length
                return start.x + share * (end.x - start.x), start.y + share * (end.y - start.y), heading
            metres -= length
        return self.nodes[-1].x, self.nodes[-1].y, heading


class NavGraphEstimator(Decider):
    """Estimates skills that drive to a reachable node, from the length of the path.

    :param settings: the settings that all estimators have; the ``speed`` is in metres per second.
    :param target: the argument with the target node.
    :param start: the argument with the start node; if empty or missing, the node closest to the pose.
    :param pose: the coordinates x and y of the start, in metres in the fixed frame.
    :param interface: a Position3DInterface to publish the pose; None: the pose is not published.
    """

    def __init__(
        self,
        graph: NavGraph,
        settings: EstimatorSettings | None = None,
        *,
        target: EstimatorProperty[str] | None = None,
        start: EstimatorProperty[str] | None = None,
        pose: tuple[float, float] = (0.0, 0.0),
        interface: Any = None,
    ) -> None:
        self.settings = settings or EstimatorSettings()
        self.priority = self.settings.priority
        self._graph = graph
        self._target = target or EstimatorProperty("place")
        self._start = start or EstimatorProperty("")
        self._interface = interface
        self._drive: _Drive | None = None
        self._publish_pose((*pose, 0.0))

    @classmethod
    def from_config(
        cls, config: Configuration, graph: NavGraph, board: BlackBoard, prefix: str = NAVGRAPH_PREFIX
    ) -> NavGraphEstimator:
        """Read ``target``, ``start``, ``pose-update`` and the :class:`EstimatorSettings` below ``prefix``.

        The configuration of amcl names the interface of the pose, and the pose at the start.

        :raises SkillerError: as :meth:`EstimatorSettings.from_config`.
        :raises BlackBoardError: if the pose has another writer.
        """
        settings = EstimatorSettings.from_config(config, prefix)
        interface: Any = None
        if config.get_bool(f"{prefix}/pose-update", default=True):
            name = config.get_str(f"{_AMCL_PREFIX}/pose_interface_id", default="Pose")
            interface = board.open_for_writing("Position3DInterface", name, owner=OWNER)
            interface.frame = config.get_str("/frames/fixed", default="map")
        return cls(
            graph,
            settings,
            target=EstimatorProperty.from_config(config, prefix, "target", config.get_str, "place"),
            start=EstimatorProperty.from_config(config, prefix, "start", config.get_str, ""),
            pose=(
                config.get_float(f"{_AMCL_PREFIX}/init_pose_x", default=0.0),
                config.get_float(f"{_AMCL_PREFIX}/init_pose_y", default=0.0),
            ),
            interface=interface,
        )

    @property
    def pose(self) -> tuple[float, float, float]:
        """The robot's pose: x and y in metres, heading in radians."""
        return self._pose

    def decide(self, call: SkillStringCall) -> Outcome | None:
        """Return the duration of the path; None if the target is not a reachable node."""
        if not self.settings.allows(call):
            return None
        entry = self.settings.find_entry(call)
        target = argument_text(call.args.get(self._target.value_for(entry), ""))
        start = argument_text(call.args.get(self._start.value_for(entry), ""))
        if not start:
            closest = self._graph.closest_node(*self._pose[:2])
            start = closest.name if closest is not None else ""
        if self._graph.node(start) is None or self._graph.node(target) is None:
            return None
        path = self._graph.search_path(start, target)
        if path is None:
            return None
        self._drive = _Drive(call, path.nodes)
        return Outcome(path.cost / self.settings.speed)

    def progress(self, call: SkillStringCall, seconds: float) -> None:
        """Advance along the path and publish the pose."""
        # another decider may have the duration of a later call
        if self._drive is not None and self._drive.call is call:
            self._publish_pose(self._drive.pose(seconds * self.settings.speed))

    def _publish_pose(self, pose: tuple[float, float, float]) -> None:
        self._pose = pose
        if self._interface is not None:
            x, y, heading = pose
            self._interface.translation = (x, y, 0.0)
            self._interface.rotation = (0.0, 0.0, math.sin(heading / 2), math.cos(heading / 2))
            # the field has 31 bits, and a simulation may run for years
            self._interface.visibility_history = min(self._interface.visibility_history + 1, 2**31 - 1)
            self._interface.write()

    def close(self) -> None:
        """Close the interface of the pose."""
        if self._interface is not None:
            self._interface.close()
