"""A finding of a check: a kind of mistake, its position in a file, a message and a hint."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path
from typing import Any, Final

from cxbridge.clipstext.syntax import Lines
from cxbridge.errors import CxbridgeError
from cxbridge.printing import one_line


class Severity(StrEnum):
    """The severity of a finding. Errors make ``cxbridge check`` exit with status 1."""

    ERROR = "error"
    WARNING = "warning"
    NOTE = "note"


@dataclass(frozen=True, slots=True)
class Code:
    """A kind of finding.

    :param name: a stable name such as ``CX201``, which comments use to silence findings.
    :param title: the mistake, in a few words.
    :param explanation: the cause or the consequence, in whole sentences.
    """

    name: str
    severity: Severity
    title: str
    explanation: str


@dataclass(frozen=True, slots=True)
class SourcePlace:
    """A position in a file.

    :param line: the line, from 1; 0 for the whole file.
    :param column: the column, from 1; 0 for the whole line.
    """

    file: str
    line: int = 0
    column: int = 0

    @classmethod
    def at(cls, file: str, lines: Lines, offset: int) -> SourcePlace:
        """Return the position of an offset in a file.

        :param lines: the lines of the file.
        """
        return cls(file, lines.line_at(offset), lines.column_at(offset))


@dataclass(frozen=True, slots=True)
class Finding:
    """A finding of a check.

    :param message: the mistake, in one sentence.
    :param hint: the remedy; may be empty.
    """

    code: Code
    place: SourcePlace
    message: str
    hint: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the finding as JSON values."""
        return {
            "code": self.code.name,
            "severity": self.code.severity.value,
            "file": self.place.file,
            "line": self.place.line,
            "column": self.place.column,
            "message": self.message,
            "hint": self.hint,
        }

    def __str__(self) -> str:
        line = f":{self.place.line}" if self.place.line else ""
        column = f":{self.place.column}" if line and self.place.column else ""
        position = f"{self.place.file}{line}{column}"
        text = _join_lines(f"{position}: {self.code.severity.value} {self.code.name}: {self.message}")
        return text + (f"\n  hint: {_join_lines(self.hint)}" if self.hint else "")


def shorten_path(finding: Finding) -> Finding:
    """Return a finding with the path from the working directory, if the file is below it."""
    path, folder = Path(finding.place.file), Path.cwd()
    if not path.is_absolute() or not path.is_relative_to(folder):
        return finding
    return replace(finding, place=replace(finding.place, file=str(path.relative_to(folder))))


def _join_lines(text: str) -> str:
    """Return a text on one line, so that editors can parse the output; line ends become blanks."""
    return one_line(" ".join(line.strip() for line in text.splitlines()))


# The two codes without a check module: these mistakes prevent loading the agent, which the checks need.
UNREADABLE_AGENT: Final = Code(
    "CX101",
    Severity.ERROR,
    "the agent cannot be read",
    "A file of the configuration is missing or wrong, or a value in the configuration has the wrong type. "
    "Nothing can be loaded until the mistake is mended.",
)


CONFLICTING_PROGRAM: Final = Code(
    "CX212",
    Severity.WARNING,
    "a program that cannot be a part of an agent",
    "CLIPS loads the file alone, but not together with the executive's core: facts, templates or functions "
    "of both have the same names.",
)


def make_error_finding(error: CxbridgeError, code: Code = UNREADABLE_AGENT) -> Finding:
    """Return an error as a finding."""
    place = SourcePlace(error.file or "", error.line or 0, error.column or 0)
    return Finding(code, place, error.message, error.hint or "")
