"""The errors and warnings of a definition, collected during one reading."""

from __future__ import annotations

from typing import Final

from msgspec import Struct, field

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.names import is_identifier, is_reserved
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

MAX_FINDINGS: Final = 100
"""The maximal number of reported errors of a file."""

_COMMENT_HINT = "begin it with <comment>What it is for</comment>"


class TooManyFindings(Exception):  # noqa: N818 - ends the reading, is no error of its own
    """The file has too many errors; reading ends."""


class Findings(Struct):
    """The errors and warnings of one file.

    :param file: the name of the file for messages.
    """

    file: str | None
    errors: list[InterfaceDefinitionError] = field(default_factory=list)
    warnings: list[InterfaceDefinitionError] = field(default_factory=list)

    def error(self, element: Element, message: str, hint: str, attribute: str | None = None) -> None:
        """Report an error at an element or one of its attributes.

        :raises TooManyFindings: if there are too many.
        """
        if len(self.errors) >= MAX_FINDINGS:
            raise TooManyFindings
        self.errors.append(self._make(element, message, hint, attribute))

    def warn(self, element: Element, message: str, hint: str, attribute: str | None = None) -> None:
        """Report a construct that Fawkes accepts but that is probably a mistake."""
        if len(self.warnings) < MAX_FINDINGS:
            self.warnings.append(self._make(element, message, hint, attribute))

    def _make(
        self, element: Element, message: str, hint: str, attribute: str | None
    ) -> InterfaceDefinitionError:
        line, column = element.place_of(attribute) if attribute else (element.line, element.column)
        return InterfaceDefinitionError(message, file=self.file, line=line, column=column, hint=hint)

    def attribute(self, element: Element, name: str, example: str) -> str | None:
        """Return a required attribute; report it if it is missing or empty."""
        value = element.attributes.get(name)
        if value is None:
            self.error(element, f"<{element.name}> has no attribute '{name}'", f'write {name}="{example}"')
        elif not value:
            self.error(element, f"attribute '{name}' is empty", f'write {name}="{example}"', name)
        return value or None

    def name(self, element: Element, subject: str, reserved: frozenset[str], example: str) -> str | None:
        """Return the attribute ``name``, or None after an error."""
        name = self.attribute(element, "name", example)
        if name is None:
            return None
        if not is_identifier(name):
            self.error(
                element,
                f"'{name}' cannot be the name of {subject}",
                "a name has letters, digits and underscores, and does not begin with a digit",
                "name",
            )
            return None
        if is_reserved(name, reserved):
            self.error(
                element,
                f"'{name}' cannot be the name of {subject}: the name is reserved",
                f"take another name, e.g. my_{name}",
                "name",
            )
            return None
        return name

    def comment(self, element: Element, subject: str) -> str:
        """Return the text of an element, which is required as its comment."""
        if not element.text:
            self.error(
                element,
                f"{subject} has no comment",
                f"describe its purpose: <{element.name} ...>purpose</{element.name}>",
            )
        return " ".join(element.text.split())

    def comment_child(self, element: Element, subject: str) -> str:
        """Return the text of the ``comment`` child, which is required."""
        comments = element.find_all("comment")
        if not comments or not comments[0].text:
            place = comments[0] if comments else element
            self.error(place, f"{subject} has no comment", _COMMENT_HINT)
            return ""
        return " ".join(comments[0].text.split())

    def loose_comment(self, element: Element, subject: str) -> str:
        """Return the text of the ``comment`` child; warn if there is only other text, as Fawkes accepts."""
        comments = element.find_all("comment")
        if element.text and not (comments and comments[0].text):
            self.warn(comments[0] if comments else element, f"{subject} has no comment", _COMMENT_HINT)
            return ""
        return self.comment_child(element, subject)

    def only(self, element: Element, allowed: tuple[str, ...]) -> None:
        """Report children that an element cannot have.

        Fawkes ignores them. A name similar to an allowed one is an error, because the interface would lack
        that part; other names cause a warning.
        """
        strangers = [child for child in element.children if child.name not in allowed]
        for child in strangers[:MAX_FINDINGS]:
            rest = f"<{element.name}> may hold " + (", ".join(f"<{name}>" for name in allowed) or "text only")
            hint = did_you_mean(child.name, allowed, rest)
            misspelt = did_you_mean(child.name, [name for name in allowed if name != "comment"])
            note = self.error if misspelt else self.warn
            note(child, f"<{child.name}> does not belong into <{element.name}>", hint)

    def known_attributes(self, element: Element, known: tuple[str, ...]) -> None:
        """Warn of attributes that Fawkes ignores."""
        for name in element.attributes:
            if name not in known:
                self.warn(
                    element,
                    f"attribute '{name}' of <{element.name}> is ignored",
                    did_you_mean(name, known, f"it knows {', '.join(known)}"),
                    name,
                )


class NameScope(Struct):
    """Names that must be unique.

    :param findings: gets the errors of duplicate names.
    """

    findings: Findings
    _seen: dict[str, tuple[str, int]] = field(default_factory=dict)

    def add(self, element: Element, subject: str, name: str, shown: str | None = None) -> bool:
        """Add a name; report a duplicate and return False."""
        if name in self._seen:
            other, line = self._seen[name]
            self.findings.error(
                element,
                f"{subject} '{shown or name}' has the name of {other} in line {line}",
                "every name may be used once: rename or remove one",
                "name",
            )
            return False
        self._seen[name] = (subject, element.line)
        return True
