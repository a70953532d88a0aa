"""Coordinate frames and navigation graph for Lua, as numbers and texts."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

from cxbridge.skiller.lua.host import from_lua, guard, to_lua
from cxbridge.space.navgraph.graph import (
    NavGraph,
    NavGraphNode,
    property_as_bool,
    property_as_float,
    property_as_int,
)
from cxbridge.space.tf.buffer import StampedTransform, TransformBuffer

_CONVERSIONS: dict[str, Callable[[str], Any]] = {
    "float": property_as_float,
    "int": property_as_int,
    "bool": property_as_bool,
}


def make_place_functions(
    transforms: TransformBuffer | None, navgraph: NavGraph | None
) -> dict[str, Callable[..., Any]]:
    """Return the functions of ``tf`` and ``navgraph`` by their Lua names.

    :param transforms: the transforms of ``tf``; None: ``tf`` has no frames.
    :param navgraph: the graph of ``navgraph``; None: ``navgraph`` is nil in Lua, as without the feature in
        Fawkes.
    """
    buffer = transforms or TransformBuffer()
    functions: dict[str, Callable[..., Any]] = {
        "tf_frame_exists": lambda frame: buffer.frame_exists(from_lua(frame)),
        "tf_can_transform": lambda target, source, time_us: buffer.can_transform(
            from_lua(target), from_lua(source), int(time_us)
        ),
        "tf_lookup": lambda target, source, time_us: _flatten_transform(
            buffer.lookup(from_lua(target), from_lua(source), int(time_us))
        ),
        "tf_lookup_via": lambda target, target_us, source, source_us, fixed_frame: _flatten_transform(
            buffer.lookup_via(
                from_lua(target), int(target_us), from_lua(source), int(source_us), from_lua(fixed_frame)
            )
        ),
    }
    functions |= {} if navgraph is None else _make_navgraph_functions(navgraph)
    return {name: guard(function) for name, function in functions.items()}


def _make_navgraph_functions(graph: NavGraph) -> dict[str, Callable[..., Any]]:
    def find_closest(
        x: float, y: float, property_name: str, include_unconnected: Any, other_than: str
    ) -> tuple[str, float, float] | None:
        node = graph.closest_node(
            x,
            y,
            from_lua(property_name),
            include_unconnected=bool(include_unconnected),
            other_than=from_lua(other_than),
        )
        return _flatten_node(node)

    def find_property(node_name: str, name: str) -> str | None:
        node = graph.node(from_lua(node_name))
        return None if node is None else _text_or_nil(node.properties.get(from_lua(name)))

    def find_path(start: str, goal: str) -> tuple[Any, ...] | None:
        """Return the length of the path in metres and the names of its nodes; None without a path."""
        path = graph.search_path(from_lua(start), from_lua(goal))
        return None if path is None else (path.cost, *_node_names(path.nodes))

    return {
        "nav_name": lambda: to_lua(graph.name),
        "nav_node": lambda name: _flatten_node(graph.node(from_lua(name))),
        "nav_closest": find_closest,
        "nav_search": lambda name: _node_names(graph.search_nodes(from_lua(name))),
        "nav_reachable": lambda name: tuple(map(to_lua, graph.neighbours(from_lua(name)))),
        "nav_property": find_property,
        "nav_default": lambda name: _text_or_nil(graph.default_properties.get(from_lua(name))),
        "nav_convert": lambda kind, text: _CONVERSIONS[kind](text),
        "nav_path": find_path,
    }


def _node_names(nodes: Iterable[NavGraphNode]) -> tuple[str, ...]:
    return tuple(to_lua(node.name) for node in nodes)


def _flatten_transform(transform: StampedTransform) -> tuple[float, ...]:
    """Return translation (x, y, z), rotation (x, y, z, w) and time in microseconds."""
    return (*transform.transform.translation, *transform.transform.rotation, transform.stamp_us)


def _flatten_node(node: NavGraphNode | None) -> tuple[str, float, float] | None:
    """Return the name and the coordinates of a node in metres; None stays None."""
    return None if node is None else (to_lua(node.name), node.x, node.y)


def _text_or_nil(value: str | None) -> str | None:
    return None if value is None else to_lua(value)
