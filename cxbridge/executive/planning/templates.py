"""Templates of PDDL problems in the language of Fawkes' ``pddl-robot-memory``.

=================================  ==========================================================
``<<#NAME|QUERY>> body <</NAME>>``  the body, once for each document that the query (JSON) finds
``<<#NAME>> body <</NAME>>``        the same again, with the query that NAME had before
``<<field>>``                       a value of the document; ``<<a_b>>`` of a document in it,
                                   ``<<a_0>>`` an element of an array, ``<<a>>`` all of them, each
                                   after a blank
``<<GOAL>>``                        a value given to :meth:`Template.fill`, everywhere
=================================  ==========================================================

A field that the document lacks is empty.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from cxbridge.executive.planning.errors import PlanningError
from cxbridge.executive.robmem.values import ObjectId

Find = Callable[[dict[str, dict[str, Any]]], Mapping[str, list[dict[str, Any]]]]
"""Returns the documents of several queries, by section."""

_TAG: Final = re.compile(r"<<(?P<mark>[#/]?)(?P<name>[A-Za-z0-9_]+)(?:\|(?P<query>.*?))?>>", re.DOTALL)
_UNQUOTED_KEY: Final = re.compile(r"([{,]\s*)([A-Za-z_$][\w$.]*)\s*:")
_UNPRINTABLE: Final = "INVALID_VALUE_TYPE"


@dataclass(frozen=True, slots=True)
class _Section:
    name: str
    parts: list[str | _Field | _Section]


@dataclass(frozen=True, slots=True)
class _Field:
    name: str


class PlannerTemplate:
    """A parsed template.

    :param file: the file name for errors.
    :raises PlanningError: if sections do not match or a query is not JSON.
    """

    def __init__(self, text: str, file: str = "") -> None:
        self._file = file
        self._text = text
        self.queries: dict[str, dict[str, Any]] = {}
        self.warnings: list[str] = []
        self._root = self._parse()

    def fill(self, find: Find, values: Mapping[str, str]) -> str:
        """Return the filled text.

        :param find: called once with all queries.
        :param values: fields of the whole text.
        """
        documents = find(self.queries) if self.queries else {}
        return "".join(_fill(self._root, dict(values), documents))

    def _parse(self) -> _Section:
        stack = [_Section("", [])]  # the open sections: sections may be nested
        end = 0
        for tag in _TAG.finditer(self._text):
            stack[-1].parts.append(self._text[end : tag.start()])
            end = tag.end()
            name = tag["name"]
            if tag["mark"] == "#":
                self._record_query(name, tag["query"], tag.start())
                section = _Section(name, [])
                stack[-1].parts.append(section)
                stack.append(section)
            elif tag["mark"] == "/":
                if stack[-1].name != name:
                    raise self._error(f"<</{name}>> ends no section", tag.start())
                stack.pop()
            else:
                stack[-1].parts.append(_Field(name))
        if len(stack) > 1:
            raise self._error(f"section <<#{stack[-1].name}>> is never ended", len(self._text))
        stack[0].parts.append(self._text[end:])
        return stack[0]

    def _record_query(self, name: str, text: str | None, offset: int) -> None:
        """Record the query of a section, for all sections of this name."""
        if text is None:
            return
        try:
            query = _read_query(text)
        except ValueError as error:
            raise self._error(f"the query of section {name} is not JSON: {error}", offset) from None
        if not isinstance(query, dict):
            raise self._error(f"the query of section {name} is not a JSON object", offset)
        # as in Fawkes, queries are stored by name
        if name in self.queries and self.queries[name] != query:
            self.warnings.append(f"section {name} has two different queries, the last one counts for both")
        self.queries[name] = query

    def _error(self, message: str, offset: int) -> PlanningError:
        return PlanningError(message, file=self._file or None, line=self._text.count("\n", 0, offset) + 1)


def _read_query(text: str) -> Any:
    """Parse a query as JSON."""
    try:
        return json.loads(text)
    except ValueError:
        # old templates have keys without quotes, and single quotes
        if "'" not in text and not _UNQUOTED_KEY.search(text):
            raise
    return json.loads(_UNQUOTED_KEY.sub(r'\1"\2":', text).replace("'", '"'))


def _fill(
    section: _Section, values: dict[str, str], documents: Mapping[str, list[dict[str, Any]]]
) -> Iterator[str]:
    """Yield the text of a section.

    :param documents: by section.
    """
    for part in section.parts:
        if isinstance(part, str):
            yield part
        elif isinstance(part, _Field):
            yield values.get(part.name, "")
        else:
            for document in documents.get(part.name, ()):
                yield from _fill(part, {**values, **dict(_fields(document))}, documents)


def _fields(document: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield name and text of each value in a document, with inner documents and arrays flattened."""
    for key, value in document.items():
        name = prefix + key
        if isinstance(value, Mapping):
            yield from _fields(value, f"{name}_")
        elif isinstance(value, list):
            yield name, "".join(f" {_text(item)}" for item in value)
            yield from _fields({str(index): item for index, item in enumerate(value)}, f"{name}_")
        else:
            yield name, _text(value)


def _text(value: Any) -> str:
    """Return a value as Fawkes' template engine prints it."""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return f"{value:f}"
    if isinstance(value, (str, int)):
        return str(value)
    return str(value) if isinstance(value, ObjectId) else _UNPRINTABLE
