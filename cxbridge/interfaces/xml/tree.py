"""Reading of XML into a tree with the lines and columns of elements.

The parser is expat of the standard library. The reader fetches nothing and expands no declared entity: it
refuses a document type with declarations, or with a file other than ``interface.dtd``, before it reads the
elements.
"""

from __future__ import annotations

import codecs
import re
from typing import Final
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

_ENTITY_HINT = "write the text itself; only &amp; &lt; &gt; &quot; &apos; work"
# A reference to an entity, except XML's five entities; a reference to a character begins with &#.
_ENTITY = re.compile(rb"&(?!(?:amp|lt|gt|quot|apos);)[A-Za-z_:][\w:.-]*;")


class Element(Struct):
    """An element with the position of its start tag; line and column count from 1."""

    name: str
    attributes: dict[str, str]
    line: int
    column: int
    children: list[Element] = field(default_factory=list)
    text: str = ""

    def find_all(self, name: str) -> list[Element]:
        """Return the children with a name."""
        return [child for child in self.children if child.name == name]


def read_tree(xml: bytes, file: str | None = None) -> Element:
    """Read a document.

    :raises InterfaceDefinitionError: if the document is not well-formed, too large or nested too deep, has an
        unaccepted document type, or uses entities.
    """
    if len(xml) > MAX_FILE_SIZE:
        raise InterfaceDefinitionError(
            f"the file has {len(xml)} bytes, the limit is {MAX_FILE_SIZE}",
            file=file,
            line=1,
            column=1,
            hint="split the file: an interface definition has a few kilobytes",
        )
    # a byte order mark would shift the columns of the first line
    xml = xml.removeprefix(codecs.BOM_UTF8)
    # with a DOCTYPE, expat silently drops unknown entities in attributes
    entity = _ENTITY.search(xml)
    if entity is not None:
        raise InterfaceDefinitionError(
            f"the entity '{entity.group().decode('utf-8', 'replace')}' is not expanded",
            file=file,
            line=xml.count(b"\n", 0, entity.start()) + 1,
            hint=_ENTITY_HINT,
        )
    return _TreeReader(xml, file).read()


class _TreeReader:
    """The handlers of expat, which build the tree."""

    def __init__(self, xml: bytes, file: str | None) -> None:
        self._xml = xml
        self._file = file
        self._open_elements: list[Element] = []
        self._element_count = 0
        self._root: Element | None = None
        self._parser = parser = expat.ParserCreate()
        parser.buffer_text = True
        parser.StartDoctypeDeclHandler = self._check_doctype
        parser.SkippedEntityHandler = self._refuse_entity
        parser.StartElementHandler = self._start_element
        parser.EndElementHandler = self._end_element
        parser.CharacterDataHandler = self._add_text

    def read(self) -> Element:
        """Return the root of the document.

        :raises InterfaceDefinitionError: as :func:`read_tree`.
        """
        try:
            self._parser.Parse(self._xml, True)  # True: the document is complete
        except expat.ExpatError as error:
            raise InterfaceDefinitionError(
                f"the file is not well-formed XML: {expat.ErrorString(error.code)}",
                file=self._file,
                line=error.lineno,
                column=error.offset + 1,
            ) from None
        # Python raises these for an unknown encoding, and for encodings with several bytes per character
        except (LookupError, ValueError) as error:
            raise self._make_error(
                f"the file is not readable as XML: {error}", "save the file as UTF-8"
            ) from None
        if self._root is None:  # pragma: no cover - expat reports a document without an element
            raise self._make_error("the document is empty", "begin with <interface name=...>")
        return self._root

    def _make_error(self, message: str, hint: str) -> InterfaceDefinitionError:
        """Return an error at the present position of expat."""
        line, column = self._parser.CurrentLineNumber, self._parser.CurrentColumnNumber + 1
        return InterfaceDefinitionError(message, file=self._file, line=line, column=column, hint=hint)

    def _check_doctype(self, name: str, system: str | None, public: str | None, has_subset: int) -> None:
        """Refuse a document type with declarations, or with a file other than ``interface.dtd``.

        The parser fetches no file, and declarations are only possible within the document type.
        """
        is_local = system is None or ("://" not in system and system.split("/")[-1] == "interface.dtd")
        if has_subset or public is not None or name != "interface" or not is_local:
            raise self._make_error(
                f"the document type '{system or public or name}' is not accepted",
                'use exactly <!DOCTYPE interface SYSTEM "interface.dtd">, or omit it',
            )

    def _refuse_entity(self, name: str, _is_parameter: bool) -> None:
        """Refuse an entity that the search in `read_tree` misses in files of other encodings."""
        raise self._make_error(f"the entity '&{name};' is not expanded", _ENTITY_HINT)

    def _start_element(self, name: str, attributes: dict[str, str]) -> None:
        parser = self._parser
        self._element_count += 1
        if self._element_count > MAX_ELEMENTS:
            raise self._make_error(f"the file has more than {MAX_ELEMENTS} elements", "split the definition")
        if len(self._open_elements) >= MAX_DEPTH:
            raise self._make_error(
                f"elements are nested more than {MAX_DEPTH} levels deep", "is an end tag missing?"
            )
        element = Element(name, attributes, parser.CurrentLineNumber, parser.CurrentColumnNumber + 1)
        if self._open_elements:
            self._open_elements[-1].children.append(element)
        else:
            self._root = element
        self._open_elements.append(element)

    def _end_element(self, _name: str) -> None:
        self._open_elements.pop()

    def _add_text(self, text: str) -> None:
        self._open_elements[-1].text += text
