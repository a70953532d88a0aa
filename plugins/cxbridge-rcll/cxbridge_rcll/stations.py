"""The machines as nodes of a navigation graph, as in navgraph-generator-mps of fawkes-robotino."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, Final

from cxbridge.space.navgraph import NavGraph, NavGraphNode
from cxbridge_rcll.field import Field, Pose

_SIDES: Final = ("I", "O")
_COLUMNS, _ROWS = 7, 8  # the zones of a half
_INSERTION_ROW: Final = 1  # the row of the robots' entrance, where no robot waits

_MIN_DISTANCE_M: Final = 1.5  # the minimum distance in metres from a waiting place to a machine

WAIT_ZONES: Final = 3  # the waiting places per half, as in the team's configuration


class StationNodes:
    """Adds announced machines and waiting places to the navigation graph of a robot.

    A machine ``C-BS`` has the nodes ``C-BS-I`` and ``C-BS-O`` before its sides, ``WAIT-C-BS-I`` and
    ``WAIT-C-BS-O`` farther away, and ``C-BS`` itself, to which no edge leads. A waiting zone is a node
    ``C-Z42``. Edges are omitted: simulated robots drive straight.

    :param field: the geometry of the field.
    :param graph: returns the graph, or raises a CxbridgeError.
    """

    def __init__(self, field: Field, graph: Callable[[], NavGraph]) -> None:
        self._field, self._graph = field, graph
        self._names: set[str] = set()

    def handle(self, message: Any) -> None:
        """Process a message to NavGraphWithMPSGeneratorInterface; ignores unknown types."""
        match message.type:
            case "UpdateStationByTagMessage":
                self._names.add(message.name)
            case "ClearMessage":
                self._names.clear()
            case "GenerateWaitZonesMessage":
                self._add_wait_zones()
            case "ComputeMessage":
                self._add_stations()

    def _add_stations(self) -> None:
        graph = self._graph()
        for name in sorted(self._names):
            for place in (f"{prefix}{name}-{side}" for prefix in ("", "WAIT-") for side in _SIDES):
                pose = self._field.find(place)
                if pose is not None:
                    properties = {"orientation": f"{pose.yaw:f}"}
                    graph.replace_node(NavGraphNode(place, pose.x, pose.y, properties))
            centre = self._centre(name)
            if centre is not None:
                graph.replace_node(NavGraphNode(name, centre.x, centre.y, {"mps": "true"}, unconnected=True))

    def _centre(self, name: str) -> Pose | None:
        """Return the centre of a machine, between its sides; None if its place is unknown."""
        first, second = (self._field.find(f"{name}-{side}") for side in _SIDES)
        if first is None or second is None:
            return None
        return Pose((first.x + second.x) / 2, (first.y + second.y) / 2)

    def _add_wait_zones(self) -> None:
        machines = [pose for pose in map(self._centre, sorted(self._names)) if pose is not None]
        for half in "CM":
            chosen: list[Pose] = []
            candidates = [
                (name, pose)
                for name, pose in _zones(self._field, half)
                if _distance(pose, machines) >= _MIN_DISTANCE_M
            ]
            while candidates and len(chosen) < WAIT_ZONES:
                # The zone that is farthest from the chosen zones, or from the machines at first.
                name, pose = max(candidates, key=lambda zone: _distance(zone[1], chosen or machines))
                chosen.append(pose)
                candidates.remove((name, pose))
                self._graph().replace_node(NavGraphNode(name, pose.x, pose.y))


def _zones(field: Field, half: str) -> Iterator[tuple[str, Pose]]:
    """Yield the zones of a half in which a robot may wait, with their names."""
    for column in range(1, _COLUMNS + 1):
        for row in range(_INSERTION_ROW + 1, _ROWS + 1):
            pose = field.find(f"{half}-Z{column}{row}")
            if pose is not None:
                yield f"{half}-Z{column}{row}", pose


def _distance(pose: Pose, poses: list[Pose]) -> float:
    """Return the distance to the nearest of several poses."""
    return min((pose.distance(other) for other in poses), default=math.inf)
