"""Parsing of YAML texts into nodes: scalars, lists and maps with their places in the file.

Tags create no Python objects, so files cannot execute code. The nodes are built from the parser's events with
bounded depth and size, so that nesting cannot exhaust the stack, and aliases of aliases cannot exhaust
memory.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final, NamedTuple

import yaml

from cxbridge.errors import ConfigError

MAX_DEPTH: Final = 100  # far above real files, far below the limit of recursion
TOO_DEEP: Final = f"values are nested more than {MAX_DEPTH} deep"
MAX_NODES: Final = 200_000  # aliases of aliases multiply the nodes of a short text
FAWKES_TAG_PREFIX: Final = "tag:fawkesrobotics.org,cfg/"
_YAML_TAG_PREFIX: Final = "tag:yaml.org,2002:"
# YAML's own tags of scalars, sequences and mappings.
_YAML_KINDS: Final = {
    yaml.ScalarEvent: ("str", "int", "float", "bool", "null"),
    yaml.SequenceStartEvent: ("seq",),
    yaml.MappingStartEvent: ("map",),
}
# The hints by a phrase of libyaml's messages.
_SYNTAX_HINTS: Final = {
    "cannot start any token": "indent with blanks, not tabs; quote a value that begins with @, ` or %",
    "mapping values are not allowed": "quote a value that has ': ' inside, or check the indentation",
}

_NULL_TEXTS: Final = frozenset({"", "~", "null", "Null", "NULL"})


class Mark(NamedTuple):
    """The place of a value.

    :param file: the file or another name of the text; empty for a value set at run time.
    :param line: the line, from 1; 0 for a value set at run time.
    :param column: the column, from 1; 0 if it is unknown.
    """

    file: str = ""
    line: int = 0
    column: int = 0

    def error(self, message: str, hint: str | None = None) -> ConfigError:
        """Return an error with this place."""
        return ConfigError(
            message, file=self.file or None, line=self.line or None, column=self.column or None, hint=hint
        )


class YamlScalar(NamedTuple):
    """A scalar.

    :param tag: the tag as the files spell it, without the exclamation mark; empty without a tag.
    :param text: the text without quotes.
    :param is_null: whether YAML reads the scalar as null.
    :param is_plain: whether the scalar has neither quotes nor a tag, so that its text may be a number or a
        bool.
    """

    mark: Mark
    tag: str
    text: str
    is_null: bool
    is_plain: bool


class YamlList(NamedTuple):
    """A sequence."""

    mark: Mark
    tag: str
    items: list[YamlNode]


class YamlMap(NamedTuple):
    """A mapping as pairs of key and value; duplicate keys are kept."""

    mark: Mark
    tag: str
    pairs: list[tuple[YamlNode, YamlNode]]


YamlNode = YamlScalar | YamlList | YamlMap


def parse_documents(content: bytes | str, name: str) -> list[YamlNode]:
    """Return the root nodes of all documents of a YAML text.

    :param name: the name of the text in errors and marks, usually its file.
    :raises ConfigError: if the text is invalid, nested too deep, or has too many values, e.g. by aliases.
    """
    text = content if isinstance(content, str) else _decode(content, name)
    loader: Any = getattr(yaml, "CLoader", yaml.Loader)  # libyaml, if PyYAML was built with it
    try:
        return list(_Composer(yaml.parse(text, Loader=loader), name).build_documents())
    except yaml.MarkedYAMLError as error:
        yaml_mark = error.problem_mark or error.context_mark
        problem = ", ".join(filter(None, (error.context, error.problem)))
        mark = Mark(name, yaml_mark.line + 1, yaml_mark.column + 1) if yaml_mark else Mark(name)
        if "maximum nesting depth" in problem:  # PyYAML 6.0.4 reaches a separate limit first
            raise mark.error(TOO_DEEP) from None
        hint = next((hint for phrase, hint in _SYNTAX_HINTS.items() if phrase in problem), None)
        raise mark.error(f"this is not valid YAML: {problem}", hint) from None
    except yaml.reader.ReaderError as error:
        line = text.count("\n", 0, max(0, min(error.position, len(text)))) + 1
        raise Mark(name, line).error(
            f"this is not valid YAML: {error.reason}", "remove the unprintable character"
        ) from None
    except (yaml.YAMLError, UnicodeError) as error:
        raise Mark(name).error(f"this is not valid YAML: {error}") from None


def _decode(encoded: bytes, name: str) -> str:
    # YAML is in UTF-8 or UTF-16; PyYAML would report a wrong byte without its line
    encoding = "utf-16" if encoded[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return encoded.decode(encoding)
    except UnicodeDecodeError as error:
        raise Mark(name, encoded.count(b"\n", 0, error.start) + 1).error(
            f"the file is not {encoding.removesuffix('-sig').upper()} text", "save it as UTF-8"
        ) from None


class _Composer:
    """Builds nodes from events, with the anchors of the document and the budget of the file."""

    def __init__(self, events: Iterator[Any], name: str) -> None:
        self._events, self._name = events, name
        self._anchors: dict[str, tuple[YamlNode, int] | None] = {}
        """The node of each anchor and its number of nodes; None while the node is incomplete."""
        self._budget = MAX_NODES

    def build_documents(self) -> Iterator[YamlNode]:
        """Yield the root of each document."""
        for event in self._events:
            if isinstance(event, yaml.DocumentStartEvent):
                self._anchors = {}
                yield self._build_node(next(self._events), 0)

    def _make_mark(self, event: Any) -> Mark:
        return Mark(self._name, event.start_mark.line + 1, event.start_mark.column + 1)

    def _use_budget(self, node_count: int, event: Any) -> None:
        self._budget -= node_count
        if self._budget < 0:
            raise self._make_mark(event).error(
                f"the file expands to more than {MAX_NODES} values", "use fewer aliases (*name)"
            )

    def _build_node(self, event: Any, depth: int) -> YamlNode:
        if isinstance(event, yaml.AliasEvent):
            return self._resolve_alias(event)
        if depth > MAX_DEPTH:
            raise self._make_mark(event).error(TOO_DEEP)
        budget_before = self._budget
        self._use_budget(1, event)
        if event.anchor:
            self._anchors[event.anchor] = None
        node: YamlNode = (
            self._build_scalar(event)
            if isinstance(event, yaml.ScalarEvent)
            else self._build_list(event, depth)
            if isinstance(event, yaml.SequenceStartEvent)
            else self._build_map(event, depth)
        )
        if event.anchor:
            self._anchors[event.anchor] = (node, budget_before - self._budget)
        return node

    def _resolve_alias(self, event: Any) -> YamlNode:
        if event.anchor not in self._anchors:
            raise self._make_mark(event).error(
                f"there is no anchor &{event.anchor} for the alias *{event.anchor}",
                "quote a value that starts with '*'",
            )
        anchor = self._anchors[event.anchor]
        if anchor is None:
            raise self._make_mark(event).error(f"the alias *{event.anchor} lies inside its own anchor")
        node, node_count = anchor
        self._use_budget(node_count, event)
        return node

    def _build_scalar(self, event: Any) -> YamlScalar:
        # event.implicit[0]: whether the scalar has no tag and no quotes; also true for the tag `!`
        is_null = event.implicit[0] and event.tag is None and event.value in _NULL_TEXTS
        return YamlScalar(
            self._make_mark(event), self._normalize_tag(event), event.value, is_null, event.implicit[0]
        )

    def _build_list(self, event: Any, depth: int) -> YamlList:
        items = []
        while not isinstance(child := next(self._events), yaml.SequenceEndEvent):
            items.append(self._build_node(child, depth + 1))
        return YamlList(self._make_mark(event), self._normalize_tag(event), items)

    def _build_map(self, event: Any, depth: int) -> YamlMap:
        pairs = []
        while not isinstance(child := next(self._events), yaml.MappingEndEvent):
            key = self._build_node(child, depth + 1)
            if isinstance(key, YamlScalar) and key.text == "<<":
                raise key.mark.error(
                    "'<<' does not merge maps, as in Fawkes",
                    "write the values, or use '*name' for a whole map",
                )
            pairs.append((key, self._build_node(next(self._events), depth + 1)))
        return YamlMap(self._make_mark(event), self._normalize_tag(event), pairs)

    def _normalize_tag(self, event: Any) -> str:
        """Return the tag in the spelling of the files, without the exclamation mark.

        %TAG is valid for a single document, but yaml-cpp applies the directive to the next document, too.
        Tags with Fawkes' prefix and tags without a prefix are therefore equal here. YAML's own tags only
        repeat the kind of the node and are dropped.
        """
        tag: str | None = event.tag
        if tag is None or tag == "!":
            return ""
        if tag.startswith(FAWKES_TAG_PREFIX):
            return tag.removeprefix(FAWKES_TAG_PREFIX)
        if tag.startswith("!"):
            return tag[1:]
        own_kinds = next(kinds for event_type, kinds in _YAML_KINDS.items() if isinstance(event, event_type))
        return "" if tag.removeprefix(_YAML_TAG_PREFIX) in own_kinds else tag
