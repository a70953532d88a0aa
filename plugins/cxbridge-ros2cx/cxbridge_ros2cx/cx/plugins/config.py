"""``cx::ConfigPlugin``: values of YAML files as facts ``confval``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Final

from cxbridge.config.documents import YamlList, YamlMap, YamlNode, YamlScalar, parse_documents
from cxbridge.errors import ConfigError
from cxbridge.executive.features.config import clips_scalar
from cxbridge.executive.host.values import TRUE, Symbol, Value
from cxbridge_ros2cx.confvals import scalar_type
from cxbridge_ros2cx.cx.plugin import CxPlugin

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

_TEMPLATE: Final = (
    "(deftemplate confval (slot path (type STRING)) (slot type (type SYMBOL)"
    " (allowed-values FLOAT UINT INT BOOL STRING)) (slot value)"
    " (slot is-list (type SYMBOL) (allowed-values TRUE FALSE) (default FALSE)) (multislot list-value))"
)

# a quoted or a plain key; a quoted key may contain slashes
_SEGMENT: Final = re.compile(r"'([^']*)'|([^/']+)")

Slots = dict[str, Value]


class ConfigPlugin(CxPlugin):
    """Defines ``config-load`` and the template ``confval``."""

    def init_context(self, env: ClipsEnvironment) -> None:
        env.build(_TEMPLATE)
        env.define(
            "config-load", lambda file, prefix: self._load(env, Path(file), prefix), 2, types="*;sy;sy"
        )

    def split(self, prefix: str) -> tuple[str, list[str]]:
        """Return the path prefix of the facts, and the keys that lead to the values."""
        path = f"/{prefix.removeprefix('/')}".removesuffix("/") if prefix else ""
        return path, [segment for segment in path.split("/") if segment]

    def _load(self, env: ClipsEnvironment, file: Path, prefix: str) -> None:
        """Assert a fact for each value below a prefix of a YAML file."""
        path, segments = self.split(prefix)
        try:
            data = file.read_bytes()
        except OSError as error:
            self.log.error(str(ConfigError(f"cannot read the file: {error.strerror}", file=file)))
            return
        try:
            # as in the original, only the first document of the file counts
            node = _below(parse_documents(data, str(file))[:1], segments, str(file))
            for slots in self.facts(node, path):
                env.assert_fact("confval", slots)
        except ConfigError as error:
            self.log.error(str(error))

    def facts(self, node: YamlNode | None, path: str) -> Iterator[Slots]:
        return _facts(node, path)


class NewerConfigPlugin(ConfigPlugin):
    """The plug-in since pull request 33 (June 2026): quoted keys, and prefixes of lists and scalars."""

    def split(self, prefix: str) -> tuple[str, list[str]]:
        """Return the path prefix of the facts, and the keys; single quotes enclose one key."""
        segments = [quoted or plain for quoted, plain in _SEGMENT.findall(prefix)]
        return "".join(f"/{segment}" for segment in segments), segments

    def facts(self, node: YamlNode | None, path: str) -> Iterator[Slots]:
        if isinstance(node, YamlList):
            yield from _list_facts(node, path)
        elif isinstance(node, YamlScalar):
            yield {"path": path, **_scalar(node)}
        else:
            yield from _facts(node, path)


def _below(roots: list[YamlNode], segments: list[str], file: str) -> YamlNode | None:
    """Return the node below the keys of a prefix."""
    node = roots[0] if roots else None
    for segment in segments:
        pairs = node.pairs if isinstance(node, YamlMap) else []
        matches = [value for key, value in pairs if isinstance(key, YamlScalar) and key.text == segment]
        if not matches:
            raise ConfigError(f"Segment '{segment}' not found in YAML file.", file=file)
        node = matches[-1]
    return node


def _facts(node: YamlNode | None, path: str, *, in_list: bool = False) -> Iterator[Slots]:
    """Yield the slots of the facts for the values below a map; within a list each value is a string."""
    for key, value in node.pairs if isinstance(node, YamlMap) else ():
        name = key.text if isinstance(key, YamlScalar) else ""
        if isinstance(value, YamlMap):
            yield from _facts(value, f"{path}/{name}", in_list=in_list)
        elif isinstance(value, YamlList):
            yield from _list_facts(value, f"{path}/{name}")
        elif value.null:
            raise value.mark.error("NULL YAML KEY")
        else:
            slots = _scalar(value)
            # the type stays that of the scalar, only the value is text
            yield {"path": f"{path}/{name}", **slots, **({"value": value.text} if in_list else {})}


def _list_facts(node: YamlList, path: str) -> Iterator[Slots]:
    """Yield the slots of the facts for a list: all scalars as one fact, maps by their indices."""
    scalars = tuple(item.text for item in node.items if isinstance(item, YamlScalar))
    if scalars:
        yield {"path": path, "type": Symbol("STRING"), "is-list": TRUE, "list-value": scalars}
    # scalars have no index, so they do not count
    nested = [item for item in node.items if not isinstance(item, YamlScalar)]
    for index, item in enumerate(nested):
        if isinstance(item, YamlList):
            yield from _list_facts(item, f"{path}/{index}")
        else:
            yield from _facts(item, f"{path}/{index}", in_list=True)


def _scalar(node: YamlScalar) -> Slots:
    kind = scalar_type(node.text)
    value: Value = node.text
    if kind == "BOOL":
        # as in the original, only these two words are changed: yes stays yes
        value = Symbol(node.text.upper() if node.text in ("true", "false") else node.text)
    elif kind != "STRING":
        value = clips_scalar(node.text)
    return {"type": Symbol(kind), "value": value}
