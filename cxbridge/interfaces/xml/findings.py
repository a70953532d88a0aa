"""The errors and warnings of a definition, collected during one reading.

A mistake that prevents the reading of an element is raised as an error. The reader of the enclosing element
collects the error and leaves the element out. After other mistakes the reading of the element continues.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from msgspec import Struct, field

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.names import is_identifier
from cxbridge.interfaces.xml.tree import Element


class Findings(Struct):
    """The errors and warnings of one file.

    :param file: the name of the file for messages; None for a definition without a file.
    """

    file: str | None
    errors: list[InterfaceDefinitionError] = field(default_factory=list)
    warnings: list[InterfaceDefinitionError] = field(default_factory=list)

    def make_error(self, element: Element, message: str, hint: str = "") -> InterfaceDefinitionError:
        """Return an error, or a warning in the form of an error, with the place of an element."""
        return InterfaceDefinitionError(
            message, file=self.file, line=element.line, column=element.column, hint=hint or None
        )

    @contextmanager
    def collecting_error(self) -> Iterator[None]:
        """Collect an error that the block raises, and leave the block."""
        try:
            yield
        except InterfaceDefinitionError as error:
            self.errors.append(error)

    def report_error(self, element: Element, message: str) -> None:
        """Report a mistake that does not prevent the reading of an element."""
        self.errors.append(self.make_error(element, message))

    def report_warning(self, element: Element, message: str, hint: str = "") -> None:
        """Report a construct that Fawkes accepts but that is probably a mistake."""
        self.warnings.append(self.make_error(element, message, hint))

    def read_attribute(self, element: Element, name: str) -> str:
        """Return a required attribute.

        :raises InterfaceDefinitionError: if the attribute is missing or empty.
        """
        value = element.attributes.get(name)
        if not value:
            raise self.make_error(element, f"<{element.name}> has no attribute '{name}'")
        return value

    def read_name(self, element: Element, reserved_names: frozenset[str] = frozenset()) -> str:
        """Return the attribute ``name``.

        :raises InterfaceDefinitionError: if the name is missing, not an identifier, or reserved.
        """
        name = self.read_attribute(element, "name")
        if not is_identifier(name):
            raise self.make_error(
                element,
                f"'{name}' cannot be the name of a <{element.name}>",
                "a name consists of letters, digits and underscores, and does not begin with a digit",
            )
        if name in reserved_names:
            raise self.make_error(
                element, f"'{name}' cannot be the name of a <{element.name}>: the name is reserved"
            )
        return name

    def read_comment(self, element: Element) -> str:
        """Return the text of an element as its comment, and report an error if the text is missing."""
        if not element.text:
            self.report_error(element, f"<{element.name}> has no comment")
        return " ".join(element.text.split())

    def read_comment_child(self, element: Element) -> str:
        """Return the text of the ``comment`` child, and report an error if the text is missing.

        For a ``<message>`` with text, a missing ``<comment>`` is only a warning.
        """
        comments = element.find_all("comment")
        if not comments or not comments[0].text:
            is_optional = element.name == "message" and element.text
            report = self.report_warning if is_optional else self.report_error
            report(element, f"<{element.name}> has no <comment>")
            return ""
        return " ".join(comments[0].text.split())

    def check_form(
        self, element: Element, attributes: tuple[str, ...], children: tuple[str, ...] = ()
    ) -> None:
        """Warn of attributes and children outside an element's form; Fawkes and the parser ignore them.

        :param attributes: the names of the attributes that the element can have.
        :param children: the names of the elements that the element can contain.
        """
        # the element with the position, the words for the warning, the name, and the known names
        named_parts = [(element, f"attribute '{name}'", name, attributes) for name in element.attributes]
        named_parts += [(child, f"<{child.name}>", child.name, children) for child in element.children]
        for place, subject, name, known_names in named_parts:
            if name not in known_names:
                known_text = ", ".join(known_names)
                self.report_warning(
                    place,
                    f"{subject} in <{element.name}> is ignored",
                    f"known: {known_text or 'none'}",
                )


class NameScope(Struct):
    """Names that must be unique.

    :param findings: makes the errors about duplicate names.
    """

    findings: Findings
    _line_by_name: dict[str, int] = field(default_factory=dict)

    def add(self, element: Element, name: str) -> None:
        """Add a name.

        :raises InterfaceDefinitionError: if the name exists.
        """
        if name in self._line_by_name:
            raise self.findings.make_error(
                element, f"the name '{name}' is already used in line {self._line_by_name[name]}"
            )
        self._line_by_name[name] = element.line
