"""The tree of a configuration, its leaves as values, and the overlay of trees.

The rules are those of Fawkes (``libs/config/yaml_node.h``): maps merge, scalars and lists replace; a list of
maps has the path elements ``0``, ``1``, ... and is replaced as a whole. Where Fawkes silently drops a value,
an error is raised (a scalar over a map), or the value is used (a value over ``null``); see
docs/configuration.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from enum import Enum

from msgspec import Struct, field, structs

from cxbridge.config.documents import MAX_DEPTH, TOO_DEEP, Mark, YamlList, YamlMap, YamlNode, YamlScalar
from cxbridge.config.scalars import ConfigType, scalar_type
from cxbridge.config.tags import check_tag
from cxbridge.errors import ConfigError


class NodeKind(Enum):
    """The kind of a node; the value is its name in messages."""

    NULL = "nothing"
    SCALAR = "a single value"
    LIST = "a list"
    MAP = "a map"
    MAPS = "a list of maps"


class ConfigNode(Struct):
    """A node of the tree.

    :param kind: determines which of ``text``, ``items`` and ``children`` is set.
    :param mark: the place in the file.
    :param text: the unquoted text of a scalar.
    :param items: the elements of a list.
    :param children: the nodes below a map or a list of maps, by path element.
    """

    kind: NodeKind
    mark: Mark
    text: str = ""
    items: tuple[str, ...] = ()
    children: dict[str, ConfigNode] = field(default_factory=dict)

    def copy(self) -> ConfigNode:
        """Return an independent copy."""
        return structs.replace(self, children={key: child.copy() for key, child in self.children.items()})

    def find(self, path: str) -> ConfigNode | None:
        """Return the node at a path, or None; empty path elements are ignored."""
        node: ConfigNode | None = self
        for element in split_path(path):
            node = node.children.get(element) if node else None
        return node

    def leaves(self, prefix: str) -> Iterator[tuple[str, ConfigNode]]:
        """Yield path and node of all leaves below this node, in the order in which files first name them."""
        for key, child in self.children.items():
            path = f"{prefix}/{key}"
            if child.children:
                yield from child.leaves(path)
            else:
                yield path, child


def split_path(path: str) -> list[str]:
    """Return the elements of a path; ``/a//b/`` has two."""
    return [element for element in path.split("/") if element]


class ConfigValue(Struct, frozen=True):
    """A leaf of the configuration: a scalar, a list of scalars, null or an empty map.

    :param path: the full path in the spelling of the caller.
    :param text: the unquoted text of a scalar, otherwise empty.
    :param items: the unquoted texts of the elements of a list.
    :param mark: the place in the file.
    """

    path: str
    is_list: bool
    text: str
    items: tuple[str, ...]
    mark: Mark

    @property
    def type(self) -> ConfigType:
        """The type by Fawkes' rules; the type of a list is the type of its *first* element.

        An empty list is a UINT, the first of the types. Null is an empty STRING.
        """
        if self.is_list:
            return scalar_type(self.items[0]) if self.items else ConfigType.UINT
        return scalar_type(self.text)

    def error(self, message: str, hint: str | None = None) -> ConfigError:
        """Return an error with the file and line of this value."""
        return ConfigError(message, file=self.file or None, line=self.line or None, hint=hint)

    @property
    def file(self) -> str:
        """The file, empty for a value set at run time."""
        return self.mark.file

    @property
    def line(self) -> int:
        """The line from 1; 0 for a value set at run time."""
        return self.mark.line

    @property
    def location(self) -> str:
        """``FILE:LINE``; empty for a value set at run time."""
        return f"{self.file}:{self.line}" if self.file else ""


class TreeBuilder:
    """Builds trees from YAML nodes and collects probable mistakes in ``warnings``."""

    def __init__(self) -> None:
        self.warnings: list[str] = []

    def build(self, node: YamlNode, depth: int = 0) -> ConfigNode:
        """Return the tree of a YAML node.

        :param depth: the number of path elements above the node.
        :raises ConfigError: for an unknown tag, a value that violates its tag, a list or map among the single
            values of a list, a list of lists, an invalid key, a key with two values of different kinds, or
            values that are nested too deep.
        """
        check_tag(node)
        if isinstance(node, YamlScalar):
            return (
                ConfigNode(NodeKind.NULL, node.mark)
                if node.is_null
                else ConfigNode(NodeKind.SCALAR, node.mark, node.text)
            )
        if isinstance(node, YamlMap):
            return self._build_map(node, depth)
        return self._build_list(node, depth)

    def _build_list(self, node: YamlList, depth: int) -> ConfigNode:
        if not node.items:
            return ConfigNode(NodeKind.LIST, node.mark)
        if isinstance(node.items[0], YamlMap):
            children = {str(index): self.build(item, depth + 1) for index, item in enumerate(node.items)}
            return ConfigNode(NodeKind.MAPS, node.mark, children=children)
        return ConfigNode(NodeKind.LIST, node.mark, items=tuple(_read_item(item) for item in node.items))

    def _build_map(self, node: YamlMap, depth: int) -> ConfigNode:
        root = ConfigNode(NodeKind.MAP, node.mark)
        for key_node, value_node in node.pairs:
            *parents, key = _split_key(key_node)
            child_depth = depth + len(parents) + 1
            if child_depth > MAX_DEPTH:
                raise key_node.mark.error(TOO_DEEP)
            node_above = root
            for element in parents:  # a key may be a path, as in 'a/b: 1'
                node_above = node_above.children.setdefault(element, ConfigNode(NodeKind.MAP, key_node.mark))
                if node_above.kind not in (NodeKind.MAP, NodeKind.MAPS):
                    raise key_node.mark.error(
                        f"'{element}' is {node_above.kind.value} in line {node_above.mark.line}, not a map"
                    )
            child = self.build(value_node, child_depth)
            earlier_node = node_above.children.get(key)
            if earlier_node is not None:
                self._report_duplicate(key, earlier_node, child, key_node.mark)
            node_above.children[key] = child
        return root

    def _report_duplicate(
        self, key: str, earlier_node: ConfigNode, later_node: ConfigNode, mark: Mark
    ) -> None:
        """Warn of a duplicate key, whose later value is used as in Fawkes.

        :raises ConfigError: if the values have different kinds.
        """
        if earlier_node.kind is not later_node.kind:
            raise mark.error(
                f"'{key}' is {later_node.kind.value}, "
                f"but {earlier_node.kind.value} in line {earlier_node.mark.line}",
                "the key is defined twice: keep one of them",
            )
        self.warnings.append(
            f"{mark.file}:{mark.line}: '{key}' replaces the value in line {earlier_node.mark.line}"
        )


def _read_item(node: YamlNode) -> str:
    """Return the text of an element of a list; as in yaml-cpp, null becomes the text ``null``."""
    if not isinstance(node, YamlScalar):
        raise node.mark.error(
            "the elements of a list must be single values, or all of them maps",
            "give the inner list a name: '- name: [..]'" if isinstance(node, YamlList) else None,
        )
    check_tag(node)
    return "null" if node.is_null else node.text


def _split_key(node: YamlNode) -> list[str]:
    """Return the path elements of a key."""
    if not isinstance(node, YamlScalar):
        raise node.mark.error("a key must be a single word or path", "quote text with braces or brackets")
    elements = split_path(node.text)
    if not elements:
        raise node.mark.error(f"'{node.text}' is not a key", "a key must be a word, or words joined by '/'")
    return elements


def overlay(base: ConfigNode, upper: ConfigNode, path: str = "") -> None:
    """Lay the tree ``upper`` over the tree ``base``, which is changed; null over a map changes nothing.

    :raises ConfigError: if a value would replace a value of another kind.
    """
    if base.kind is NodeKind.MAP and upper.kind is NodeKind.MAP:
        for key, child in upper.children.items():
            if key in base.children:
                overlay(base.children[key], child, f"{path}/{key}")
            else:
                base.children[key] = child.copy()  # later overlays change it, and `upper` may be used again
        return
    # in place, because the parent and the configuration refer to `base`
    if base.kind is upper.kind or base.kind is NodeKind.NULL:
        for name, value in structs.asdict(upper.copy()).items():
            setattr(base, name, value)
    elif upper.kind is not NodeKind.NULL or base.kind not in (NodeKind.MAP, NodeKind.MAPS):
        position = f" ({base.mark.file}:{base.mark.line})" if base.mark.file else ""
        raise upper.mark.error(
            f"{path} is {upper.kind.value}, but its earlier value{position} is {base.kind.value}",
            "a later file may only replace a value by one of the same kind",
        )
