"""Coordinate frames and navigation graph for Lua, as numbers and texts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cxbridge.errors import SkillError
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


class PlaceAccess:
    """The functions of ``tf`` and ``navgraph`` in Lua.

    :param transforms: the transforms of ``tf``; None: ``tf`` has no frames.
    :param navgraph: the graph of ``navgraph``; None: skills have no ``navgraph``.
    """

    def __init__(self, transforms: TransformBuffer | None, navgraph: NavGraph | None) -> None:
        self._transforms = transforms or TransformBuffer()
        self._graph = navgraph

    def functions_by_name(self) -> dict[str, Callable[..., Any]]:
        """Return the functions by their Lua names."""
        buffer = self._transforms
        functions: dict[str, Callable[..., Any]] = {
            "tf_frame_exists": lambda frame: buffer.frame_exists(from_lua(frame)),
            "tf_can_transform": lambda target, source, time_us: buffer.can_transform(
                from_lua(target), from_lua(source), int(time_us)
            ),
            "tf_lookup": lambda target, source, time_us: _transform_values(
                buffer.lookup(from_lua(target), from_lua(source), int(time_us))
            ),
            "tf_lookup_via": lambda target, target_us, source, source_us, fixed_frame: _transform_values(
                buffer.lookup_via(
                    from_lua(target), int(target_us), from_lua(source), int(source_us), from_lua(fixed_frame)
                )
            ),
        }
        # without these functions `navgraph` is nil for skills, as without the feature in Fawkes
        if self._graph is not None:
            functions |= {
                "nav_name": lambda: to_lua(self._navgraph.name),
                "nav_node": lambda name: _node_values(self._navgraph.node(from_lua(name))),
                "nav_closest": self._find_closest,
                "nav_search": lambda name: self._node_names(self._navgraph.search_nodes(from_lua(name))),
                "nav_reachable": lambda name: tuple(map(to_lua, self._navgraph.neighbours(from_lua(name)))),
                "nav_property": self._find_property,
                "nav_default": lambda name: _text_or_nil(
                    self._navgraph.default_properties.get(from_lua(name))
                ),
                "nav_convert": lambda kind, text: _CONVERSIONS[kind](text),
                "nav_path": self._find_path,
            }
        return {name: guard(function) for name, function in functions.items()}

    @property
    def _navgraph(self) -> NavGraph:
        """The graph, without which Lua gets no function that uses it."""
        if self._graph is None:
            raise SkillError("there is no navigation graph")
        return self._graph

    @staticmethod
    def _node_names(nodes: list[NavGraphNode]) -> tuple[str, ...]:
        return tuple(to_lua(node.name) for node in nodes)

    def _find_closest(
        self, x: float, y: float, property_name: str, include_unconnected: Any, other_than: str
    ) -> Any:
        node = self._navgraph.closest_node(
            x,
            y,
            from_lua(property_name),
            include_unconnected=bool(include_unconnected),
            other_than=from_lua(other_than),
        )
        return _node_values(node)

    def _find_property(self, node_name: str, name: str) -> str | None:
        node = self._navgraph.node(from_lua(node_name))
        return None if node is None else _text_or_nil(node.properties.get(from_lua(name)))

    def _find_path(self, start: str, goal: str) -> Any:
        path = self._navgraph.search_path(from_lua(start), from_lua(goal))
        return None if path is None else (path.cost, *self._node_names(list(path.nodes)))


def _transform_values(transform: StampedTransform) -> tuple[float, ...]:
    return (*transform.transform.translation, *transform.transform.rotation, transform.stamp_us)


def _node_values(node: NavGraphNode | None) -> Any:
    return None if node is None else (to_lua(node.name), node.x, node.y)


def _text_or_nil(value: str | None) -> str | None:
    return None if value is None else to_lua(value)
