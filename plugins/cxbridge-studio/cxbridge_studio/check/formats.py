"""The output formats of findings: text, JSON, and GitHub's annotations."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Final

from cxbridge.printing import format_count
from cxbridge_studio.check.findings import Finding, Severity

_GITHUB_LEVELS: Final = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.NOTE: "notice"}


def format_text(findings: Sequence[Finding]) -> str:
    """Return an entry for each finding, and a last line with the counts."""
    return "\n".join([*map(str, findings), format_severity_counts(findings)])


def format_severity_counts(findings: Sequence[Finding]) -> str:
    """Return the number of findings of each severity, such as ``1 error, 2 warnings``."""
    counts = Counter(finding.code.severity for finding in findings)
    texts = [format_count(counts[severity], severity.value) for severity in Severity if counts[severity]]
    return ", ".join(texts) or "no findings"


def format_json(findings: Sequence[Finding]) -> str:
    """Return the findings as a JSON list of objects."""
    return json.dumps([finding.to_json() for finding in findings], indent=2)


def format_github(findings: Sequence[Finding]) -> str:
    """Return the findings as workflow commands, which GitHub shows next to the lines of a pull request."""
    return "\n".join(map(_make_github_annotation, findings))


def _make_github_annotation(finding: Finding) -> str:
    line = f",line={finding.place.line}" if finding.place.line else ""
    column = f",col={finding.place.column}" if line and finding.place.column else ""
    position = f"file={_escape_characters(finding.place.file, ':,')}{line}{column}"
    text = f"{finding.message}\n{finding.hint}" if finding.hint else finding.message
    command = f"{_GITHUB_LEVELS[finding.code.severity]} {position},title={finding.code.name}"
    return f"::{command}::{_escape_characters(text)}"


def _escape_characters(text: str, extra_characters: str = "") -> str:
    """Return a text with the special characters of workflow commands percent-encoded.

    :param extra_characters: further special characters: in a property, the colon and the comma, which end it.
    """
    # The percent sign comes first, because the encoding adds percent signs.
    for character in f"%\r\n{extra_characters}":
        text = text.replace(character, f"%{ord(character):02X}")
    return text


FORMATS: Final[dict[str, Callable[[Sequence[Finding]], str]]] = {
    "text": format_text,
    "json": format_json,
    "github": format_github,
}
