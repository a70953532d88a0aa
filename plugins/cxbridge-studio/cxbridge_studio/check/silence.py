"""Comments that silence a finding in the same or the next line: ``cx-check: ignore CODE REASON``."""

from __future__ import annotations

import re
from collections.abc import Iterable
from functools import cache
from pathlib import Path
from typing import Final

from cxbridge_studio.check.findings import Finding

_COMMENT: Final = re.compile(r"[;#-]\s*cx-check: ignore (?P<codes>CX\d+(?:, ?CX\d+)*)\s+\S")


def without_silenced(findings: Iterable[Finding]) -> list[Finding]:
    """Return the findings that no comment silences. A comment without a reason has no effect."""
    rows = cache(_rows)
    return [finding for finding in findings if not _is_silenced(finding, rows(finding.place.file))]


def _is_silenced(finding: Finding, rows: list[str]) -> bool:
    line = finding.place.line
    return any(
        finding.code.name in re.split(r", ?", match["codes"])
        for row in rows[max(line - 2, 0) : line]
        if (match := _COMMENT.search(row))
    )


def _rows(file: str) -> list[str]:
    """Return the lines of a file; an empty list if it cannot be read."""
    try:
        return Path(file).read_text("utf-8", "surrogateescape").splitlines()
    except (OSError, ValueError):
        return []
