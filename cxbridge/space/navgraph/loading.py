"""Loading of Fawkes' navigation graph files (YAML)."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Final

from cxbridge.config.documents import YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.errors import ConfigError, NavGraphError
from cxbridge.space.navgraph import joining
from cxbridge.space.navgraph.graph import NavGraph, NavGraphEdge, NavGraphNode

TAG_PREFIX: Final = "tag:fawkesrobotics.org,navgraph/"
"""The prefix of ``!`` tags in graph files."""

_PAIR = 2  # the coordinates of a node, and the ends of a connection


def load_navgraph(file: str | Path, *, allow_multi_graph: bool = False) -> NavGraph:
    """Load a graph file.

    :param allow_multi_graph: whether the graph may have several parts without connection.
    :raises NavGraphError: if the file cannot be read, with the file; if it is invalid, with file and line.
    """
    try:
        content = Path(file).read_bytes()
    except OSError as error:
        raise NavGraphError(f"cannot read the navigation graph: {error.strerror}", file=file) from None
    return parse_navgraph(content, str(file), allow_multi_graph=allow_multi_graph)


def parse_navgraph(text: str | bytes, name: str, *, allow_multi_graph: bool = False) -> NavGraph:
    """Parse the text of a graph file.

    :param name: the name of the file, for errors.
    :param allow_multi_graph: see :func:`load_navgraph`.
    :raises NavGraphError: with the line, if the text is invalid.
    """
    try:
        documents = parse_documents(text, name)
    except ConfigError as error:
        raise NavGraphError(
            error.message, file=error.file, line=error.line, column=error.column, hint=error.hint
        ) from None
    # unlike a configuration, a graph has no document of includes
    if len(documents) != 1 or not isinstance(documents[0], YamlMap):
        raise NavGraphError(
            "a navigation graph must be a single map: graph-name, nodes, connections", file=name, line=1
        )
    root = {_read_text(key): value for key, value in documents[0].pairs}
    if "graph-name" not in root:
        raise _error_at(documents[0], "the graph has no 'graph-name'")
    graph = NavGraph(_read_text(root["graph-name"]), _read_properties(root.get("default-properties")))
    for item in _read_items(root.get("nodes"), "nodes"):
        with _locate_errors(item):
            graph.add_node(_read_node(item))
    for item in _read_items(root.get("connections"), "connections"):
        _add_edge(graph, item)
    if not allow_multi_graph and (unreachable := graph.unreachable_nodes()):
        origin = next(node.name for node in graph.nodes if not node.unconnected)
        raise _error_at(
            documents[0],
            f"the graph is not fully connected: {', '.join(unreachable)} cannot be reached from '{origin}'",
            "add edges, tag the nodes !unconnected, or allow it (/navgraph/allow_multi_graph)",
        )
    return graph


def _read_node(item: YamlNode) -> NavGraphNode:
    pairs = item.pairs if isinstance(item, YamlMap) else []
    fields = {_read_text(key): value for key, value in pairs}
    if not {"name", "pos"} <= fields.keys():
        raise _error_at(item, "a node must be a map with 'name' and 'pos'")
    pos = fields["pos"]
    if not isinstance(pos, YamlList) or len(pos.items) < _PAIR:
        raise _error_at(pos, "'pos' must be [x, y] in metres")
    properties = _read_properties(fields.get("properties"))
    if "insert-mode" in properties:
        raise _error_at(item, "'insert-mode' is not supported", "write the edges of the node as connections")
    # Fawkes ignores further coordinates
    x, y = (_read_number(coordinate) for coordinate in pos.items[:_PAIR])
    return NavGraphNode(
        _read_text(fields["name"]),
        x,
        y,
        properties,
        item.tag == f"{TAG_PREFIX}unconnected",
    )


def _add_edge(graph: NavGraph, item: YamlNode) -> None:
    if not isinstance(item, YamlList) or len(item.items) != _PAIR:
        raise _error_at(item, "a connection must be [FROM, TO]")
    edge = NavGraphEdge(_read_text(item.items[0]), _read_text(item.items[1]), item.tag == f"{TAG_PREFIX}dir")
    adders: dict[str, Callable[[NavGraph, NavGraphEdge], None]] = {
        f"{TAG_PREFIX}allow-intersection": NavGraph.add_edge,
        f"{TAG_PREFIX}split-intersection": joining.add_and_split,
    }
    add = adders.get(item.tag, joining.add_without_crossing)
    with _locate_errors(item):
        add(graph, edge)


def _read_properties(node: YamlNode | None) -> dict[str, str]:
    properties: dict[str, str] = {}
    for item in _read_items(node, "properties"):
        if isinstance(item, YamlScalar):  # as in Fawkes, a name alone is a flag
            properties[item.text] = "true"
        elif isinstance(item, YamlMap):
            properties.update((_read_text(key), _read_text(value)) for key, value in item.pairs)
        else:
            raise _error_at(item, "a property must be a name, or 'name: value'")
    return properties


def _read_items(node: YamlNode | None, name: str) -> list[YamlNode]:
    if node is None or (isinstance(node, YamlScalar) and node.is_null):
        return []
    if not isinstance(node, YamlList):
        raise _error_at(node, f"'{name}' must be a list")
    return node.items


def _read_text(node: YamlNode) -> str:
    if not isinstance(node, YamlScalar) or node.is_null:
        raise _error_at(node, "the value must be a string")
    return node.text


def _read_number(node: YamlNode) -> float:
    try:
        number = float(_read_text(node))
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise _error_at(node, f"'{_read_text(node)}' is not a number")
    return number


@contextmanager
def _locate_errors(node: YamlNode) -> Iterator[None]:
    """Add the position of a YAML node to the errors of the graph, which knows no files."""
    try:
        yield
    except NavGraphError as error:
        if error.line:
            raise  # the error of an inner node has its own position
        raise _error_at(node, error.message, error.hint) from None


def _error_at(node: YamlNode, message: str, hint: str | None = None) -> NavGraphError:
    mark = node.mark
    return NavGraphError(message, file=mark.file, line=mark.line, column=mark.column, hint=hint)
