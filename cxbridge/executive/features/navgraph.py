"""The feature ``navgraph``: the navigation graph as facts, and blocked edges. See docs/features.md."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from cxbridge.clipstext.values import quoted
from cxbridge.errors import CxbridgeError
from cxbridge.executive.feature import Feature
from cxbridge.executive.host.environment import CORE_DIR, ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, Value

if TYPE_CHECKING:
    from cxbridge.space.navgraph import NavGraph

_TEMPLATES_FILE = CORE_DIR / "features" / "navgraph.clp"
_LOGGER_NAME = "ClipsNavGraphThread"


class NavGraphFeature(Feature):
    """Provides ``navgraph-block-edge``, ``navgraph-unblock-edge`` and the facts of the graph.

    :param find_graph: returns the shared graph, or raises a CxbridgeError without a graph.
    """

    name = "navgraph"

    def __init__(self, find_graph: Callable[[], NavGraph]) -> None:
        self._find_graph = find_graph
        self._revisions: dict[str, int] = {}  # the revision of the graph in the facts, by environment

    def init_context(self, env: ClipsEnvironment) -> None:
        env.load(_TEMPLATES_FILE)
        self._assert_graph(env)
        env.define(
            "navgraph-block-edge", lambda *ends: self._set_blocked(env, *ends, block=True), 2, types="*;sy;sy"
        )
        env.define(
            "navgraph-unblock-edge",
            lambda *ends: self._set_blocked(env, *ends, block=False),
            2,
            types="*;sy;sy",
        )

    def before_run(self, env: ClipsEnvironment) -> None:
        """Assert the facts of the graph again after a change."""
        # without a revision, the graph could not be read: another attempt in each loop would fail, too
        revision = self._revisions.get(env.name)
        if revision is not None and revision != self._find_graph().revision:
            env.bus.logger(_LOGGER_NAME).debug(f"Graph changed, re-asserting in environment {env.name}")
            env.call("navgraph-cleanup")
            self._assert_graph(env)

    def context_destroyed(self, env: ClipsEnvironment) -> None:
        self._revisions.pop(env.name, None)

    def _assert_graph(self, env: ClipsEnvironment) -> None:
        try:
            graph = self._find_graph()
        except CxbridgeError as error:
            env.bus.logger(_LOGGER_NAME).warn(f"Failed to assert navgraph: {error}")
            env.assert_string(f"(navgraph-load-fail {quoted(str(error))})")
            return
        self._revisions[env.name] = graph.revision
        env.assert_fact("navgraph", {"name": graph.name})
        for node in graph.nodes:
            properties = _property_fields({**graph.default_properties, **node.properties})
            env.assert_fact(
                "navgraph-node",
                {
                    "name": node.name,
                    "pos": (_six_decimals(node.x), _six_decimals(node.y)),
                    "properties": properties,
                },
            )
        for edge in graph.edges:
            env.assert_fact(
                "navgraph-edge",
                {
                    "from": edge.start,
                    "to": edge.end,
                    "directed": TRUE if edge.directed else FALSE,
                    "properties": _property_fields(edge.properties),
                },
            )

    def _set_blocked(self, env: ClipsEnvironment, start: str, end: str, *, block: bool) -> None:
        """Block or unblock an edge in all its directions, as Fawkes' constraint on edges does.

        As in Fawkes, the order of the ends must be that of the edge in the graph, even for an edge in both
        directions.
        """
        try:
            graph = self._find_graph()
        except CxbridgeError:
            edge = None
        else:
            edge = next((edge for edge in graph.edges if (edge.start, edge.end) == (start, end)), None)
        if edge is None:
            verb = "block" if block else "unblock"
            env.bus.logger(_LOGGER_NAME).warn(
                f"Environment {env.name} tried to {verb} edge {start}--{end}, which does not exist in graph"
            )
            return
        for origin, destination in ((start, end), (end, start)):
            if not block:
                graph.unblock(origin, destination)
            elif edge.joins(origin, destination):  # not for the opposite direction of a directed edge
                graph.block(origin, destination)


def _property_fields(properties: Mapping[str, str]) -> tuple[Value, ...]:
    """Return the fields of the slot ``properties``: names, each followed by its value, sorted by name."""
    return tuple(text for name in sorted(properties) for text in (name, properties[name]))


def _six_decimals(number: float) -> float:
    """Return a coordinate with six decimals, as in the facts of Fawkes."""
    return float(f"{number:f}")
