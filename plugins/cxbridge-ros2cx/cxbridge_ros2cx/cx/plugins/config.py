"""The plug-in ``cx::ConfigPlugin``: values of YAML files as facts ``confval``.

Rules call ``config-load`` with a file and a prefix: the keys that lead to the values, separated by slashes.
The errors about keys and values have the texts of the ROS 2 CX, carologistics/clips_executive.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.config.documents import YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.errors import ConfigError
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.values import TRUE, Symbol, Value
from cxbridge_ros2cx.confvals import find_scalar_type
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_TEMPLATE: Final = (
    "(deftemplate confval (slot path (type STRING)) (slot type (type SYMBOL)"
    " (allowed-values FLOAT UINT INT BOOL STRING)) (slot value)"
    " (slot is-list (type SYMBOL) (allowed-values TRUE FALSE) (default FALSE)) (multislot list-value))"
)

# a quoted or an unquoted key of a prefix; a quoted key may contain slashes
_SEGMENT: Final = re.compile(r"'([^']*)'|([^/']+)")

Slots = dict[str, Value]  # the slots of a fact `confval` by name


class ConfigPlugin(CxPlugin):
    """Defines ``config-load`` and the template ``confval``."""

    def init_context(self, env: ClipsEnvironment) -> None:
        env.build(_TEMPLATE)
        env.define(
            "config-load", lambda file, prefix: self._load(env, Path(file), prefix), 2, types="*;sy;sy"
        )

    def split_prefix(self, prefix: str) -> tuple[str, list[str]]:
        """Return the path prefix of the facts, and the keys that lead to the values."""
        path = f"/{prefix.removeprefix('/')}".removesuffix("/") if prefix else ""
        return path, [segment for segment in path.split("/") if segment]

    def _load(self, env: ClipsEnvironment, file: Path, prefix: str) -> None:
        """Assert a fact for each value below a prefix of a YAML file."""
        path, segments = self.split_prefix(prefix)
        try:
            # as in the ROS 2 CX, only the first document of the file counts
            documents = parse_documents(file.read_bytes(), str(file))[:1]
            for slots in self.make_slots(_find_node(documents, segments, str(file)), path):
                env.assert_fact("confval", slots)
        except OSError as error:
            self.log.error(str(ConfigError(f"cannot read the file: {error.strerror}", file=file)))
        except ConfigError as error:
            self.log.error(str(error))

    def make_slots(self, node: YamlNode | None, path: str) -> Iterator[Slots]:
        """Yield the slots of a fact for each value below a node."""
        return _make_map_slots(node, path)


class QuotedKeyConfigPlugin(ConfigPlugin):
    """The plug-in since pull request 33 of carologistics/clips_executive (June 2026).

    Keys of a prefix may be quoted, and a prefix may lead to a list or a scalar.
    """

    def split_prefix(self, prefix: str) -> tuple[str, list[str]]:
        """Return the path prefix of the facts, and the keys; single quotes enclose one key."""
        segments = [quoted or unquoted for quoted, unquoted in _SEGMENT.findall(prefix)]
        return "".join(f"/{segment}" for segment in segments), segments

    def make_slots(self, node: YamlNode | None, path: str) -> Iterator[Slots]:
        if isinstance(node, YamlList):
            yield from _make_list_slots(node, path)
        elif isinstance(node, YamlScalar):
            yield {"path": path, **_make_scalar_slots(node)}
        else:
            yield from _make_map_slots(node, path)


def _find_node(roots: list[YamlNode], segments: list[str], file: str) -> YamlNode | None:
    """Return the node below the keys of a prefix; None for an empty file.

    :raises ConfigError: if a key is missing.
    """
    node = roots[0] if roots else None
    for segment in segments:
        pairs = node.pairs if isinstance(node, YamlMap) else []
        values_by_key = {key.text: value for key, value in pairs if isinstance(key, YamlScalar)}
        if segment not in values_by_key:
            raise ConfigError(f"Segment '{segment}' not found in YAML file.", file=file)
        node = values_by_key[segment]
    return node


def _make_map_slots(node: YamlNode | None, path: str, *, is_in_list: bool = False) -> Iterator[Slots]:
    """Yield the slots of the facts for the values below a map; other nodes have none.

    :param is_in_list: whether a list contains the map; then each value is a string.
    :raises ConfigError: if a value is null.
    """
    for key, value in node.pairs if isinstance(node, YamlMap) else ():
        name = key.text if isinstance(key, YamlScalar) else ""
        if isinstance(value, YamlMap):
            yield from _make_map_slots(value, f"{path}/{name}", is_in_list=is_in_list)
        elif isinstance(value, YamlList):
            yield from _make_list_slots(value, f"{path}/{name}")
        elif value.is_null:
            raise value.mark.error("NULL YAML KEY")  # the text of the ROS 2 CX, in spite of a null value
        else:
            # as in the ROS 2 CX, within a list the value is a STRING, but the type is the type of the scalar
            text_slot: Slots = {"value": value.text} if is_in_list else {}
            yield {"path": f"{path}/{name}", **_make_scalar_slots(value), **text_slot}


def _make_list_slots(node: YamlList, path: str) -> Iterator[Slots]:
    """Yield the slots of the facts for a list: one fact has all scalars; maps and lists have indices."""
    scalars = tuple(item.text for item in node.items if isinstance(item, YamlScalar))
    if scalars:
        yield {"path": path, "type": Symbol("STRING"), "is-list": TRUE, "list-value": scalars}
    # as in the ROS 2 CX, an index counts maps and lists, but no scalars
    for index, item in enumerate(item for item in node.items if not isinstance(item, YamlScalar)):
        if isinstance(item, YamlList):
            yield from _make_list_slots(item, f"{path}/{index}")
        else:
            yield from _make_map_slots(item, f"{path}/{index}", is_in_list=True)


def _make_scalar_slots(node: YamlScalar) -> Slots:
    type_name = find_scalar_type(node.text)
    value: Value = node.text
    if type_name == "BOOL":
        # as in the ROS 2 CX, only these two words are changed: yes stays yes
        value = Symbol(node.text.upper() if node.text in ("true", "false") else node.text)
    elif type_name != "STRING":
        value = clips_scalar(node.text)
    return {"type": Symbol(type_name), "value": value}
