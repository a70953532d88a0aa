"""The errors and warnings of a definition, collected during one reading.

A mistake that prevents the reading of an element is raised and collected where the element is left out: each
element reports at most one such mistake. After other mistakes the reading of the element continues.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

from msgspec import Struct, field

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.names import is_identifier, is_reserved
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

# A file of a mebibyte may have 100,000 mistakes, and each mistake costs a search for similar names.
MAX_FINDINGS: Final = 100
"""The maximum number of reported errors of a file."""

_COMMENT_HINT = "begin it with <comment>What it is for</comment>"


class TooManyFindings(Exception):  # noqa: N818 - a signal to end the reading
    """The file has too many errors; reading ends."""


class Findings(Struct):
    """The errors and warnings of one file.

    :param file: the name of the file for messages.
    """

    file: str | None
    errors: list[InterfaceDefinitionError] = field(default_factory=list)
    warnings: list[InterfaceDefinitionError] = field(default_factory=list)

    def make_error(
        self, element: Element, message: str, hint: str, attribute: str | None = None
    ) -> InterfaceDefinitionError:
        """Return an error at an element or one of its attributes, to be raised."""
        line, column = element.attribute_position(attribute) if attribute else (element.line, element.column)
        return InterfaceDefinitionError(message, file=self.file, line=line, column=column, hint=hint)

    @contextmanager
    def collecting_error(self) -> Iterator[None]:
        """Collect a mistake that is raised in this block.

        :raises TooManyFindings: if the file has too many errors.
        """
        try:
            yield
        except InterfaceDefinitionError as error:
            self._add(error)

    def report_error(self, element: Element, message: str, hint: str, attribute: str | None = None) -> None:
        """Report a mistake that does not prevent the reading of an element.

        :raises TooManyFindings: if the file has too many errors.
        """
        self._add(self.make_error(element, message, hint, attribute))

    def _add(self, error: InterfaceDefinitionError) -> None:
        if len(self.errors) >= MAX_FINDINGS:
            raise TooManyFindings
        self.errors.append(error)

    def report_warning(self, element: Element, message: str, hint: str, attribute: str | None = None) -> None:
        """Report a construct that Fawkes accepts but that is probably a mistake."""
        if len(self.warnings) < MAX_FINDINGS:
            self.warnings.append(self.make_error(element, message, hint, attribute))

    def read_attribute(self, element: Element, name: str, example: str) -> str:
        """Return a required attribute.

        :raises InterfaceDefinitionError: if the attribute is missing or empty.
        """
        value = element.attributes.get(name)
        hint = f'write {name}="{example}"'
        if value is None:
            raise self.make_error(element, f"<{element.name}> has no attribute '{name}'", hint)
        if not value:
            raise self.make_error(element, f"attribute '{name}' is empty", hint, name)
        return value

    def read_name(self, element: Element, subject: str, reserved: frozenset[str], example: str) -> str:
        """Return the attribute ``name``.

        :raises InterfaceDefinitionError: if the name is missing, not an identifier, or reserved.
        """
        name = self.read_attribute(element, "name", example)
        if not is_identifier(name):
            raise self.make_error(
                element,
                f"'{name}' cannot be the name of {subject}",
                "a name consists of letters, digits and underscores, and does not begin with a digit",
                "name",
            )
        if is_reserved(name, reserved):
            raise self.make_error(
                element,
                f"'{name}' cannot be the name of {subject}: the name is reserved",
                f"choose another name, e.g. my_{name}",
                "name",
            )
        return name

    def read_comment(self, element: Element, subject: str) -> str:
        """Return the text of an element, which is required as its comment."""
        if not element.text:
            self.report_error(
                element,
                f"{subject} has no comment",
                f"describe its purpose: <{element.name} ...>purpose</{element.name}>",
            )
        return " ".join(element.text.split())

    def read_comment_child(self, element: Element, subject: str, *, allows_text: bool = False) -> str:
        """Return the text of the ``comment`` child, which is required.

        :param allows_text: whether text outside a ``comment`` is enough, with a warning, as in Fawkes.
        """
        comments = element.find_all("comment")
        if not comments or not comments[0].text:
            report = self.report_warning if allows_text and element.text else self.report_error
            report(comments[0] if comments else element, f"{subject} has no comment", _COMMENT_HINT)
            return ""
        return " ".join(comments[0].text.split())

    def check_form(
        self, element: Element, attributes: tuple[str, ...], children: tuple[str, ...] = ()
    ) -> None:
        """Report attributes and children that an element cannot have.

        Fawkes ignores them. A child with a misspelt name is an error, because the interface would lack that
        part; all other names cause a warning.
        """
        for name in element.attributes:
            if name not in attributes:
                self.report_warning(
                    element,
                    f"attribute '{name}' of <{element.name}> is ignored",
                    did_you_mean(name, attributes, f"it may have {', '.join(attributes) or 'none'}"),
                    name,
                )
        unknown_children = [child for child in element.children if child.name not in children]
        # the search for similar names takes long, and further findings would be dropped
        for child in unknown_children[:MAX_FINDINGS]:
            contents = ", ".join(f"<{name}>" for name in children) or "text only"
            hint = did_you_mean(child.name, children, f"<{element.name}> may contain {contents}")
            misspelt = did_you_mean(child.name, [name for name in children if name != "comment"])
            report = self.report_error if misspelt else self.report_warning
            report(child, f"<{child.name}> does not belong in <{element.name}>", hint)


class NameScope(Struct):
    """Names that must be unique.

    :param findings: makes the errors of duplicate names.
    """

    findings: Findings
    _owners: dict[str, tuple[str, int]] = field(default_factory=dict)  # kind and line by name

    def add(self, element: Element, subject: str, name: str, label: str | None = None) -> None:
        """Add a name.

        :param label: the name for the error, if the definition spells it differently.
        :raises InterfaceDefinitionError: if the name exists.
        """
        if name in self._owners:
            owner, line = self._owners[name]
            raise self.findings.make_error(
                element,
                f"{subject} '{label or name}' has the same name as {owner} in line {line}",
                "use each name only once: rename or remove one of them",
                "name",
            )
        self._owners[name] = (subject, element.line)
