"""The mistakes of a definition, collected while it is read: all of them, not only the first."""

from __future__ import annotations

from typing import Final

from msgspec import Struct, field

from cxbridge.errors import InterfaceDefinitionError
from cxbridge.interfaces.names import is_identifier, is_reserved
from cxbridge.interfaces.xml.tree import Element
from cxbridge.suggestions import did_you_mean

MAX_FINDINGS: Final = 100
"""How many mistakes of a file are reported at most."""

_COMMENT_HINT = "begin it with <comment>What it is for</comment>"


class TooManyFindings(Exception):  # noqa: N818 - ends the reading, is no error of its own
    """The file has too many mistakes: the reader stops."""


class Findings(Struct):
    """The mistakes of one file.

    :param file: the file's name for messages, None when there is no file.
    """

    file: str | None
    errors: list[InterfaceDefinitionError] = field(default_factory=list)
    warnings: list[InterfaceDefinitionError] = field(default_factory=list)

    def error(self, element: Element, message: str, hint: str, attribute: str | None = None) -> None:
        """Note a mistake at an element or at one of its attributes.

        :raises TooManyFindings: there are enough of them.
        """
        if len(self.errors) >= MAX_FINDINGS:
            raise TooManyFindings
        self.errors.append(self._make(element, message, hint, attribute))

    def warn(self, element: Element, message: str, hint: str, attribute: str | None = None) -> None:
        """Note something that Fawkes accepts and that is hardly meant."""
        if len(self.warnings) < MAX_FINDINGS:
            self.warnings.append(self._make(element, message, hint, attribute))

    def _make(
        self, element: Element, message: str, hint: str, attribute: str | None
    ) -> InterfaceDefinitionError:
        line, column = element.place_of(attribute) if attribute else (element.line, element.column)
        return InterfaceDefinitionError(message, file=self.file, line=line, column=column, hint=hint)

    def attribute(self, element: Element, name: str, example: str) -> str | None:
        """Return a required attribute; note it when it is missing or empty."""
        value = element.attributes.get(name)
        if value is None:
            self.error(element, f"<{element.name}> has no attribute '{name}'", f'write {name}="{example}"')
        elif not value:
            self.error(element, f"attribute '{name}' is empty", f'write {name}="{example}"', name)
        return value or None

    def name(self, element: Element, subject: str, reserved: frozenset[str], example: str) -> str | None:
        """Return the attribute ``name`` when it is one that may be used; note why when it is not."""
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
        """Return an element's own text; note it when there is none, for it is required."""
        if not element.text:
            self.error(
                element,
                f"{subject} has no comment",
                f"describe its purpose: <{element.name} ...>purpose</{element.name}>",
            )
        return " ".join(element.text.split())

    def comment_child(self, element: Element, subject: str) -> str:
        """Return the text of the element ``comment`` inside; note it when there is none."""
        comments = element.find_all("comment")
        if not comments or not comments[0].text:
            place = comments[0] if comments else element
            self.error(place, f"{subject} has no comment", _COMMENT_HINT)
            return ""
        return " ".join(comments[0].text.split())

    def loose_comment(self, element: Element, subject: str) -> str:
        """Return the text of the element ``comment`` inside, where Fawkes is content with any text at all."""
        comments = element.find_all("comment")
        if element.text and not (comments and comments[0].text):
            self.warn(comments[0] if comments else element, f"{subject} has no comment", _COMMENT_HINT)
            return ""
        return self.comment_child(element, subject)

    def only(self, element: Element, allowed: tuple[str, ...]) -> None:
        """Note the children of an element that do not belong there.

        Fawkes ignores them. Here one that looks like a misspelt part of the definition is an error, since the
        interface would lack that part; anything else makes a warning.
        """
        strangers = [child for child in element.children if child.name not in allowed]
        for child in strangers[:MAX_FINDINGS]:
            rest = f"<{element.name}> may hold " + (", ".join(f"<{name}>" for name in allowed) or "text only")
            hint = did_you_mean(child.name, allowed, rest)
            misspelt = did_you_mean(child.name, [name for name in allowed if name != "comment"])
            note = self.error if misspelt else self.warn
            note(child, f"<{child.name}> does not belong into <{element.name}>", hint)

    def known_attributes(self, element: Element, known: tuple[str, ...]) -> None:
        """Note attributes that mean nothing; Fawkes ignores them, so they do not make the file wrong."""
        for name in element.attributes:
            if name not in known:
                self.warn(
                    element,
                    f"attribute '{name}' of <{element.name}> is ignored",
                    did_you_mean(name, known, f"it knows {', '.join(known)}"),
                    name,
                )


class NameScope(Struct):
    """Names that must differ from each other.

    :param findings: where a name that comes twice is noted.
    """

    findings: Findings
    _seen: dict[str, tuple[str, int]] = field(default_factory=dict)

    def add(self, element: Element, subject: str, name: str, shown: str | None = None) -> bool:
        """Add a name; report a name that exists already and return False."""
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
