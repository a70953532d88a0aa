"""Reads navgraph files in Fawkes' layout, as much of them as a simulation needs.

::

    nodes:
      - name: kitchen
        pos: [1.0, 2.5]
        properties:
          - orientation: 1.57
    connections:
      - [kitchen, hall]
      - !dir [hall, garden]     # this way only

Everything else in the file is left alone.
"""

from __future__ import annotations

import math
from pathlib import Path

import yaml

from cxbridge.errors import ConfigError
from cxbridge.skiller.navigation.navgraph import NavGraph, Node

_ONE_WAY = "!dir"
_TAG_PREFIX = "tag:fawkesrobotics.org,navgraph/"
_PAIR = 2


def load_navgraph(file: Path) -> NavGraph:
    """Read a navgraph file.

    :raises ConfigError: when it cannot be read or makes no sense; with file and line.
    """
    try:
        root = yaml.compose(file.read_text(encoding="utf-8"), Loader=yaml.SafeLoader)
    except OSError as error:
        raise ConfigError(f"cannot read the navgraph: {error.strerror}", file=file) from None
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        mark = getattr(error, "problem_mark", None)
        what = getattr(error, "problem", None) or str(error)
        raise ConfigError(f"it is no YAML: {what}", file=file, line=mark.line + 1 if mark else None) from None
    return _Reader(file).graph(root)


class _Reader:
    """Makes a graph of what YAML says.

    :param file: for errors.
    """

    def __init__(self, file: Path) -> None:
        self._file = file

    def graph(self, root: yaml.Node | None) -> NavGraph:
        nodes: dict[str, Node] = {}
        for item in self._items(root, "nodes"):
            node = self._node(item)
            if node.name in nodes:
                raise self._error(f"there are two nodes '{node.name}'", item)
            nodes[node.name] = node
        if not nodes:
            raise self._error("the navgraph has no nodes", root, "nodes: [{name: kitchen, pos: [1.0, 2.5]}]")
        neighbours: dict[str, list[str]] = {}
        for item in self._items(root, "connections"):
            begin, end = self._connection(item, nodes)
            neighbours.setdefault(begin, []).append(end)
            if item.tag.removeprefix(_TAG_PREFIX) not in (_ONE_WAY, _ONE_WAY[1:]):
                neighbours.setdefault(end, []).append(begin)
        return NavGraph(nodes, {name: tuple(others) for name, others in neighbours.items()})

    def _node(self, item: yaml.Node) -> Node:
        name = self._get(item, "name")
        if not isinstance(name, yaml.ScalarNode) or not name.value:
            raise self._error("a node needs a name", item)
        position = self._get(item, "pos")
        if not isinstance(position, yaml.SequenceNode) or len(position.value) != _PAIR:
            raise self._error(f"the node '{name.value}' needs a position", item, "pos: [X, Y], in metres")
        x, y = (self._number(one) for one in position.value)
        orientation = None
        for entry in self._items(item, "properties"):
            given = self._get(entry, "orientation")
            if given is not None:
                orientation = self._number(given)
        return Node(name.value, x, y, orientation)

    def _connection(self, item: yaml.Node, nodes: dict[str, Node]) -> tuple[str, str]:
        if not isinstance(item, yaml.SequenceNode) or len(item.value) != _PAIR:
            raise self._error("a connection has two ends", item, "- [kitchen, hall]")
        begin, end = (str(one.value) for one in item.value)
        for name in (begin, end):
            if name not in nodes:
                raise self._error(f"a connection leads to '{name}', which is no node", item)
        return begin, end

    def _items(self, node: yaml.Node | None, key: str) -> list[yaml.Node]:
        """Return the elements of a list in a map; nothing when it is not there."""
        found = None if node is None else self._get(node, key)
        if found is None:
            return []
        if not isinstance(found, yaml.SequenceNode):
            raise self._error(f"'{key}' must be a list", found)
        return list(found.value)

    def _get(self, node: yaml.Node, key: str) -> yaml.Node | None:
        if not isinstance(node, yaml.MappingNode):
            raise self._error(f"there must be a map here, with '{key}'", node)
        return next((value for name, value in node.value if name.value == key), None)

    def _number(self, node: yaml.Node) -> float:
        try:
            number = float(node.value)
        except (TypeError, ValueError):
            number = math.nan
        if not math.isfinite(number):
            raise self._error("there must be a number here", node)
        return number

    def _error(self, message: str, node: yaml.Node | None, hint: str | None = None) -> ConfigError:
        line = None if node is None else node.start_mark.line + 1
        return ConfigError(message, file=self._file, line=line, hint=hint)
