"""Adds machines and waiting zones to a navigation graph.

The model is the plugin navgraph-generator-mps of fawkes-robotino.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Final

from cxbridge.space.navgraph import NavGraph, NavGraphNode
from cxbridge_rcll.field import Field, Pose

_SIDES: Final = ("I", "O")  # input and output
_COLUMNS, _ROWS = 7, 8  # the zones of a half
_INSERTION_ROW: Final = 1  # the row of the entrance, where no robot may wait

_MIN_DISTANCE_M: Final = 1.5  # from a waiting zone to the nearest machine

WAIT_ZONE_COUNT: Final = 3  # waiting zones in each half, as in the configuration of the team Carologistics


class StationNodes:
    """Adds machines and waiting zones to the navigation graph of a robot, on the requests of messages.

    A machine ``C-BS`` gets the nodes ``C-BS-I`` and ``C-BS-O`` before its sides, ``WAIT-C-BS-I`` and
    ``WAIT-C-BS-O`` farther away, and ``C-BS`` in its centre, which is marked as unconnected. A waiting zone
    gets a node such as ``C-Z42``. No edges are added, since simulated robots drive straight.

    :param field: the geometry of the field.
    :param get_graph: returns the graph, or raises a CxbridgeError.
    """

    def __init__(self, field: Field, get_graph: Callable[[], NavGraph]) -> None:
        self._field, self._get_graph = field, get_graph
        self._station_names: set[str] = set()

    def handle(self, message: Any) -> None:
        """Handle a message to NavGraphWithMPSGeneratorInterface; ignore messages of unknown types."""
        match message.type:
            case "UpdateStationByTagMessage":
                self._station_names.add(message.name)
            case "ClearMessage":
                self._station_names.clear()
            case "GenerateWaitZonesMessage":
                self._add_wait_zones()
            case "ComputeMessage":
                self._add_stations()

    def _add_stations(self) -> None:
        graph = self._get_graph()
        for name in sorted(self._station_names):
            for node_name in (f"{prefix}{name}-{side}" for prefix in ("", "WAIT-") for side in _SIDES):
                pose = self._field.find_pose(node_name)
                if pose is not None:
                    graph.replace_node(
                        NavGraphNode(node_name, pose.x, pose.y, {"orientation": f"{pose.yaw:f}"})
                    )
            centre = self._machine_centre(name)
            if centre is not None:
                graph.replace_node(NavGraphNode(name, centre.x, centre.y, {"mps": "true"}, unconnected=True))

    def _machine_centre(self, name: str) -> Pose | None:
        """Return the centre of a machine, between its sides; None if its position is unknown."""
        input_pose, output_pose = (self._field.find_pose(f"{name}-{side}") for side in _SIDES)
        if input_pose is None or output_pose is None:
            return None
        return Pose((input_pose.x + output_pose.x) / 2, (input_pose.y + output_pose.y) / 2)

    def _add_wait_zones(self) -> None:
        machine_centres = [
            pose for pose in map(self._machine_centre, sorted(self._station_names)) if pose is not None
        ]
        for half in "CM":  # cyan, magenta
            chosen_poses: list[Pose] = []
            candidates = {
                name: pose
                for name, pose in _waiting_zones(self._field, half)
                if _nearest_distance_m(pose, machine_centres) >= _MIN_DISTANCE_M
            }
            while candidates and len(chosen_poses) < WAIT_ZONE_COUNT:
                # the first zone is the farthest from the machines, each further zone from the chosen zones
                distances = {
                    name: _nearest_distance_m(pose, chosen_poses or machine_centres)
                    for name, pose in candidates.items()
                }
                name = max(distances, key=lambda name: distances[name])
                pose = candidates.pop(name)
                chosen_poses.append(pose)
                self._get_graph().replace_node(NavGraphNode(name, pose.x, pose.y))


def _waiting_zones(field: Field, half: str) -> Iterator[tuple[str, Pose]]:
    """Yield the name and the centre of each zone of a half in which a robot may wait."""
    for column in range(1, _COLUMNS + 1):
        for row in range(_INSERTION_ROW + 1, _ROWS + 1):
            pose = field.find_pose(f"{half}-Z{column}{row}")
            if pose is not None:
                yield f"{half}-Z{column}{row}", pose


def _nearest_distance_m(pose: Pose, poses: list[Pose]) -> float:
    """Return the distance to the nearest of several poses; infinity without poses."""
    return min((pose.distance_m(other) for other in poses), default=math.inf)
