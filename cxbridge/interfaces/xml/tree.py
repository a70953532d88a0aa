"""Reading of XML into a tree with the lines and columns of elements.

The parser is expat of the standard library. The reader fetches nothing and expands no entity: it refuses a
document type with declarations, or with a file other than ``interface.dtd``, before it reads the rest.
"""

from __future__ import annotations

import codecs
import re
from typing import Any, Final
from xml.parsers import expat

from msgspec import Struct, field

from cxbridge.errors import InterfaceDefinitionError

# The definitions of Fawkes have fewer than 20 kB.
MAX_FILE_SIZE: Final = 1 << 20
"""The maximum size of a definition in bytes."""

MAX_DEPTH: Final = 16
"""The maximum depth of nested elements; definitions need four."""

MAX_ELEMENTS: Final = 10_000
"""The maximum number of elements; the definitions of Fawkes have fewer than 200."""

_DOCTYPE_HINT = 'use exactly <!DOCTYPE interface SYSTEM "interface.dtd">, or omit it'
# A reference to an entity, except XML's five entities and numbers of characters.
_ENTITY = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos|#\d+|#x[0-9A-Fa-f]+);)")
# The quantifiers are possessive, without which a long tag that does not end would take exponential time.
_START_TAG = re.compile(rb"""<[^\s>/"']++(?:[^>"']++|"[^"]*+"|'[^']*+')*+>""")


class Element(Struct):
    """An element with the position of its start tag and attributes; line and column count from 1."""

    name: str
    attributes: dict[str, str]
    line: int
    column: int
    start_tag: bytes = b""
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def find_all(self, name: str) -> list[Element]:
        """Return the children with a name."""
        return [child for child in self.children if child.name == name]

    def attribute_position(self, attribute: str) -> tuple[int, int]:
        """Return line and column of an attribute, or of the element if the attribute is missing."""
        pattern = rb"\s(" + re.escape(attribute.encode()) + rb")\s*="
        # a value may contain the name of another attribute
        values_hidden = re.sub(
            rb""""[^"]*"|'[^']*'""", lambda value: b"." * len(value.group()), self.start_tag
        )
        match = re.search(pattern, values_hidden)
        if match is None:
            return self.line, self.column
        head = self.start_tag[: match.start(1)].decode("utf-8", "replace")
        newline = head.rfind("\n")
        if newline < 0:
            return self.line, self.column + len(head)
        return self.line + head.count("\n"), len(head) - newline


def read_tree(data: bytes, file: str | None = None) -> Element:
    """Read a document.

    :raises InterfaceDefinitionError: if the document is too large or not well-formed, or declares or uses
        entities.
    """
    if len(data) > MAX_FILE_SIZE:
        raise InterfaceDefinitionError(
            f"the file has {len(data)} bytes, the limit is {MAX_FILE_SIZE}",
            file=file,
            line=1,
            column=1,
            hint="split it: an interface definition has a few kilobytes",
        )
    # a byte order mark would shift the columns of the first line
    return _TreeReader(data.removeprefix(codecs.BOM_UTF8), file).read()


class _TreeReader:
    """The handlers of expat, which build the tree."""

    def __init__(self, data: bytes, file: str | None) -> None:
        self._data = data
        self._file = file
        self._has_entities = _ENTITY.search(data) is not None
        self._open_elements: list[Element] = []
        self._element_count = 0
        self._root: Element | None = None
        self._parser = parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = self._check_doctype
        parser.EntityDeclHandler = self._refuse_declared_entity
        parser.SkippedEntityHandler = self._refuse_entity
        parser.ExternalEntityRefHandler = self._refuse_external_entity
        parser.StartElementHandler = self._start_element
        parser.EndElementHandler = self._end_element
        parser.CharacterDataHandler = self._add_text

    def read(self) -> Element:
        """Parse the document."""
        try:
            self._parser.Parse(self._data, True)
        except expat.ExpatError as error:
            raise InterfaceDefinitionError(
                f"not well-formed XML: {expat.ErrorString(error.code)}",
                file=self._file,
                line=error.lineno,
                column=error.offset + 1,
                hint=self._find_hint(error.code),
            ) from None
        except (LookupError, ValueError) as error:
            raise self._make_error(f"not readable as XML: {error}", "save the file as UTF-8") from None
        if self._root is None:  # pragma: no cover - expat reports a document without an element
            raise self._make_error("the document is empty", "begin with <interface name=...>")
        return self._root

    def _find_hint(self, code: int) -> str:
        """Return a hint for an error of expat."""
        index = self._parser.ErrorByteIndex
        if code == _INVALID_TOKEN and self._data[index : index + 1] >= b"\x80":
            return "save the file as UTF-8, or name its encoding in the first line"
        return _EXPAT_HINTS.get(expat.ErrorString(code), "check this place and the text just before it")

    def _make_error(self, message: str, hint: str, start: bytes = b"") -> InterfaceDefinitionError:
        """Return an error at the present position of expat, or at the last ``start`` before it."""
        line, column = self._parser.CurrentLineNumber, self._parser.CurrentColumnNumber + 1
        head, separator, _ = self._data[: self._parser.CurrentByteIndex].rpartition(start or b"\n")
        if start and separator:
            line, column = head.count(b"\n") + 1, len(head) - head.rfind(b"\n")
        return InterfaceDefinitionError(message, file=self._file, line=line, column=column, hint=hint)

    def _check_doctype(self, name: str, system: str | None, public: str | None, has_subset: int) -> None:
        problem = ""
        if has_subset:
            problem = "a document type with declarations of its own is not accepted"
        elif public is not None or name != "interface" or not _is_local_dtd(system):
            problem = f"the document type '{system or public or name}' is not accepted"
        if problem:
            raise self._make_error(problem, _DOCTYPE_HINT, b"<!DOCTYPE")

    def _refuse_declared_entity(self, name: str, *_: Any) -> None:
        raise self._make_error(
            f"the file declares an entity '{name}'; entities are never expanded", _DOCTYPE_HINT
        )

    def _refuse_entity(self, name: str, _is_parameter: bool) -> None:
        raise self._make_error(
            f"the entity '&{name};' is not expanded",
            "write the text itself; only &amp; &lt; &gt; &quot; &apos; work",
        )

    def _refuse_external_entity(
        self, _context: str, _base: str | None, system: str | None, _public: str | None
    ) -> int:
        raise self._make_error(f"the external entity '{system}' is not fetched", "write the text itself")

    def _start_element(self, name: str, attributes: dict[str, str]) -> None:
        parser = self._parser
        self._element_count += 1
        if self._element_count > MAX_ELEMENTS:
            raise self._make_error(f"the file has more than {MAX_ELEMENTS} elements", "split the definition")
        if len(self._open_elements) >= MAX_DEPTH:
            raise self._make_error(
                f"elements are nested more than {MAX_DEPTH} levels deep", "close the elements before"
            )
        match = _START_TAG.match(self._data, parser.CurrentByteIndex)
        # without a tag, e.g. in UTF-16, errors have the place of the element
        start_tag = match.group() if match else b""
        element = Element(
            name, attributes, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1, start_tag
        )
        # in a document with a DOCTYPE, expat silently drops unknown entities in attributes
        entity = _ENTITY.search(start_tag) if self._has_entities else None
        if entity is not None:
            self._refuse_entity(
                start_tag[entity.end() :].partition(b";")[0].decode("utf-8", "replace"), False
            )
        if self._open_elements:
            self._open_elements[-1].children.append(element)
        else:
            self._root = element
        self._open_elements.append(element)

    def _end_element(self, _name: str) -> None:
        self._open_elements.pop()

    def _add_text(self, text: str) -> None:
        self._open_elements[-1].text += text


def _is_local_dtd(system: str | None) -> bool:
    """Return whether a document type names no file or ``interface.dtd``, which is never fetched."""
    return system is None or ("://" not in system and system.split("/")[-1] == "interface.dtd")


_INVALID_TOKEN = expat.errors.codes[expat.errors.XML_ERROR_INVALID_TOKEN]
_EXPAT_HINTS = {
    "mismatched tag": "close the elements in the opposite order of opening them",
    "no element found": "the file ends too early: close every element, the last one is </interface>",
    "unclosed token": "the file ends inside a tag or comment: close it",
    "duplicate attribute": "write each attribute only once",
    "undefined entity": "write the text itself; only &amp; &lt; &gt; &quot; &apos; work",
    "junk after document element": "put everything inside the one <interface> element",
    "unknown encoding": "save the file as UTF-8",
    "not well-formed (invalid token)": "write & as &amp; and < as &lt;, and put attribute values into quotes",
}
