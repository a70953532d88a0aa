"""Templates of PDDL problems in the language of Fawkes' ``pddl-robot-memory``.

=================================  ==========================================================
``<<#NAME|QUERY>> body <</NAME>>``  a section: the body, once for each document that the query (JSON) finds
``<<#NAME>> body <</NAME>>``        a section with the query of another section NAME
``<<field>>``                       a value of the section's document; ``<<a_b>>`` is the field b of the
                                   inner document a, ``<<a_0>>`` the first element of the array a, and
                                   ``<<a>>`` all elements, each after a blank
``<<GOAL>>``                        a value given to :meth:`ProblemTemplate.fill`, in and outside of sections
=================================  ==========================================================

A section within a section also has the fields of the outer document. A field without a value is empty.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from cxbridge_planning.errors import PlanningError
from cxbridge_robot_memory.values import ObjectId

Documents = Mapping[str, list[dict[str, Any]]]
"""The documents that the query of each section finds, by the name of the section."""

_TAG: Final = re.compile(r"<<(?P<mark>[#/]?)(?P<name>[A-Za-z0-9_]+)(?:\|(?P<query>.*?))?>>", re.DOTALL)
_UNQUOTED_KEY: Final = re.compile(r"([{,]\s*)([A-Za-z_$][\w$.]*)\s*:")
_UNPRINTABLE: Final = "INVALID_VALUE_TYPE"  # Fawkes' text for a value that it cannot print


@dataclass(frozen=True, slots=True)
class _Section:
    """A section of a template; without a name, the whole template."""

    name: str
    body: list[str | _Field | _Section]


@dataclass(frozen=True, slots=True)
class _Field:
    """A tag that a field's value replaces."""

    name: str


class ProblemTemplate:
    """A parsed template.

    :param file: the file name for errors; empty if unknown.
    :ivar queries: the queries by the name of the section.
    :ivar warnings: mistakes that do not prevent filling the template.
    :raises PlanningError: if the tags of sections do not match, or a query is not a JSON object.
    """

    def __init__(self, text: str, file: str = "") -> None:
        self._text, self._file = text, file
        self.queries: dict[str, dict[str, Any]] = {}
        self.warnings: list[str] = []
        self._root = self._parse()

    def fill(self, documents: Documents, values: Mapping[str, str]) -> str:
        """Return the text with documents and values in place of the tags.

        :param values: fields that all sections have, e.g. ``GOAL``; a document's field of the same name hides
            the value.
        """
        return "".join(_fill_section(self._root, dict(values), documents))

    def _parse(self) -> _Section:
        open_sections = [_Section("", [])]  # outermost first
        last_tag_end = 0
        for tag in _TAG.finditer(self._text):
            open_sections[-1].body.append(self._text[last_tag_end : tag.start()])
            last_tag_end = tag.end()
            name = tag["name"]
            if tag["mark"] == "#":
                self._record_query(name, tag["query"], tag.start())
                section = _Section(name, [])
                open_sections[-1].body.append(section)
                open_sections.append(section)
            elif tag["mark"] == "/":
                if open_sections[-1].name != name:
                    raise self._error(f"<</{name}>> does not close a section", tag.start())
                open_sections.pop()
            else:
                open_sections[-1].body.append(_Field(name))
        if len(open_sections) > 1:
            raise self._error(f"section <<#{open_sections[-1].name}>> is never closed", len(self._text))
        open_sections[0].body.append(self._text[last_tag_end:])
        return open_sections[0]

    def _record_query(self, name: str, query_text: str | None, offset: int) -> None:
        """Record the query of a section, for all sections of this name.

        :param query_text: None if the section has the query of another section.
        :param offset: the offset of the section in the template, for errors.
        :raises PlanningError: if the query is not a JSON object.
        """
        if query_text is None:
            return
        try:
            query = _read_query(query_text)
        except ValueError as error:
            raise self._error(f"the query of section {name} is not JSON: {error}", offset) from None
        if not isinstance(query, dict):
            raise self._error(f"the query of section {name} is not a JSON object", offset)
        # as in Fawkes, queries are stored by name, so that sections of the same name share a query
        if name in self.queries and self.queries[name] != query:
            self.warnings.append(f"section {name} has two different queries: the last query is used for both")
        self.queries[name] = query

    def _error(self, message: str, offset: int) -> PlanningError:
        return PlanningError(message, file=self._file or None, line=self._text.count("\n", 0, offset) + 1)


def _read_query(query_text: str) -> Any:
    """Parse a query as JSON, or as the JavaScript of MongoDB's shell, as in some templates of Fawkes.

    :raises ValueError: if the query is neither.
    """
    try:
        return json.loads(query_text)
    except ValueError:
        # JavaScript permits keys without quotes, and single quotes
        if "'" not in query_text and not _UNQUOTED_KEY.search(query_text):
            raise
    return json.loads(_UNQUOTED_KEY.sub(r'\1"\2":', query_text).replace("'", '"'))


def _fill_section(section: _Section, values: dict[str, str], documents: Documents) -> Iterator[str]:
    """Yield the filled parts of a section's body in order.

    :param values: the texts of fields by name.
    """
    for item in section.body:
        if isinstance(item, str):
            yield item
        elif isinstance(item, _Field):
            yield values.get(item.name, "")
        else:
            for document in documents.get(item.name, ()):
                yield from _fill_section(item, {**values, **dict(_list_fields(document))}, documents)


def _list_fields(document: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield name and text of each value in a document, including the values of inner documents and arrays."""
    for key, value in document.items():
        name = prefix + key
        if isinstance(value, Mapping):
            yield from _list_fields(value, f"{name}_")
        elif isinstance(value, list):
            yield name, "".join(f" {_format_value(item)}" for item in value)
            yield from _list_fields({str(index): item for index, item in enumerate(value)}, f"{name}_")
        else:
            yield name, _format_value(value)


def _format_value(value: Any) -> str:
    """Return a value as Fawkes' template engine prints it."""
    if isinstance(value, bool):
        return str(int(value))
    if isinstance(value, float):
        return f"{value:f}"
    if isinstance(value, (str, int)):
        return str(value)
    return str(value) if isinstance(value, ObjectId) else _UNPRINTABLE
