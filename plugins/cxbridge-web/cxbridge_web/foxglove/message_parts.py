"""Parts of Foxglove messages: times, poses, and a navigation graph as a scene."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import atan2, cos, hypot, isfinite, sin
from typing import Any, Final, TypeAlias, TypeGuard

from cxbridge.events import NavGraphRead

MAP_FRAME: Final = "map"
"""The frame of navigation graphs."""

_Point: TypeAlias = tuple[float, float]

_NODE_DIAMETER_M: Final = 0.12
_EDGE_WIDTH_M: Final = 0.03
_LABEL_HEIGHT_M: Final = 0.2  # height of the letters, and of their place above the node
_MAX_ARROW_HEAD_LENGTH_M: Final = 0.25
_LINE_LIST: Final = 2  # Foxglove's number for a line for each pair of points
_NODE_COLOUR: Final = {"r": 0.16, "g": 0.42, "b": 0.68, "a": 1.0}
_EDGE_COLOUR: Final = {"r": 0.45, "g": 0.47, "b": 0.5, "a": 1.0}
_LABEL_COLOUR: Final = {"r": 0.2, "g": 0.22, "b": 0.25, "a": 1.0}
# the members with lists of shapes, all of which the schema of a scene's entity requires
_PRIMITIVES: Final = ("arrows", "cubes", "spheres", "cylinders", "lines", "triangles", "texts", "models")


def make_time(time_us: int) -> dict[str, int]:
    """Return a time in Foxglove's JSON form, which has no times before 1970."""
    seconds, microseconds = divmod(max(time_us, 0), 1_000_000)
    return {"sec": seconds, "nsec": microseconds * 1000}


def make_vector(values: Sequence[float]) -> dict[str, float]:
    return dict(zip("xyz", values, strict=True))


def make_quaternion(values: Sequence[float]) -> dict[str, float]:
    """Return a rotation. All zeros, the value of an unwritten interface, mean no rotation."""
    return dict(zip("xyzw", values if any(values) else (0.0, 0.0, 0.0, 1.0), strict=True))


def make_pose(position: Sequence[float], rotation: Sequence[float] = (0.0, 0.0, 0.0, 1.0)) -> dict[str, Any]:
    return {"position": make_vector(position), "orientation": make_quaternion(rotation)}


def make_navgraph_scene(event: NavGraphRead) -> dict[str, Any]:
    """Return a ``SceneUpdate``: nodes are spheres with labels, edges lines, and directed edges arrows."""
    positions = dict(_find_node_positions(event))
    undirected_edges: list[tuple[_Point, _Point]] = []
    directed_edges: list[tuple[_Point, _Point]] = []
    for edge in event.edges.values():
        start, end = positions.get(edge.get("from")), positions.get(edge.get("to"))
        if start is not None and end is not None:
            (directed_edges if edge.get("directed") else undirected_edges).append((start, end))
    points = [make_vector((*point, 0.0)) for edge in undirected_edges for point in edge]
    entity: dict[str, Any] = {
        "timestamp": make_time(event.time_us),
        "frame_id": MAP_FRAME,
        "id": event.graph,
        "lifetime": {"sec": 0, "nsec": 0},  # until the entity is replaced
        "frame_locked": True,
        "metadata": [{"key": "nodes", "value": str(len(positions))}],
        **{name: [] for name in _PRIMITIVES},
        "spheres": [
            {
                "pose": make_pose((x, y, 0.0)),
                "size": make_vector((_NODE_DIAMETER_M,) * 3),
                "color": _NODE_COLOUR,
            }
            for x, y in positions.values()
        ],
        "lines": [_make_line_list(points)] if points else [],
        "arrows": [_make_arrow(start, end) for start, end in directed_edges],
        "texts": [_make_label(name, *point) for name, point in positions.items()],
    }
    return {"deletions": [], "entities": [entity]}


def _find_node_positions(event: NavGraphRead) -> Iterator[tuple[str, _Point]]:
    """Yield the nodes with a position. A recording of another program may have any value."""
    for name, node in event.nodes.items():
        x, y = node.get("x"), node.get("y")
        if is_number(x) and is_number(y):
            yield name, (x, y)


def is_number(value: Any) -> TypeGuard[float]:
    """Return whether a value is a finite number, as JSON requires."""
    return isinstance(value, int | float) and isfinite(value)


def _make_line_list(points: list[dict[str, float]]) -> dict[str, Any]:
    return {
        "type": _LINE_LIST,
        "pose": make_pose((0.0, 0.0, 0.0)),
        "thickness": _EDGE_WIDTH_M,
        "scale_invariant": False,
        "points": points,
        "color": _EDGE_COLOUR,
        "colors": [],
        "indices": [],
    }


def _make_arrow(start: _Point, end: _Point) -> dict[str, Any]:
    """Return an arrow, rotated from the x axis, along which Foxglove's arrows point."""
    (start_x, start_y), (end_x, end_y) = start, end
    dx, dy = end_x - start_x, end_y - start_y
    length, half_angle = hypot(dx, dy), atan2(dy, dx) / 2  # a quaternion has half the angle of its rotation
    head_length = min(_MAX_ARROW_HEAD_LENGTH_M, length / 2)
    return {
        "pose": make_pose((*start, 0.0), (0.0, 0.0, sin(half_angle), cos(half_angle))),
        "shaft_length": length - head_length,
        "shaft_diameter": _EDGE_WIDTH_M,
        "head_length": head_length,
        "head_diameter": 3 * _EDGE_WIDTH_M,
        "color": _EDGE_COLOUR,
    }


def _make_label(name: str, x: float, y: float) -> dict[str, Any]:
    return {
        "pose": make_pose((x, y, _LABEL_HEIGHT_M)),
        "billboard": True,
        "font_size": _LABEL_HEIGHT_M,
        "scale_invariant": False,
        "color": _LABEL_COLOUR,
        "text": name,
    }
