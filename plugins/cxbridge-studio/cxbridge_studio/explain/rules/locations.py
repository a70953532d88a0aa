"""The position of a rule in the files, and the reason why an environment lacks the rule."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clipstext.syntax import rule_lines
from cxbridge.executive.host.loading import UNCLOSED
from cxbridge.printing import short_path
from cxbridge_studio.explain.rules.snapshot import Rulebook


@dataclass(frozen=True, slots=True)
class SourceLine:
    file: str
    line: int

    def __str__(self) -> str:
        return f"{short_path(self.file)}:{self.line}"


def find_rule(rule: str, files: Iterable[str]) -> SourceLine | None:
    """Return the position of a rule; the last one if several files define it."""
    location = None
    for file in dict.fromkeys(files):
        try:
            text = Path(file).read_bytes().decode("utf-8", "surrogateescape")
        except OSError:
            continue
        line = rule_lines(text).get(rule) if rule in text else None
        location = SourceLine(file, line) if line else location
    return location


def why_missing(rule: str, book: Rulebook) -> str:
    """Return why an environment lacks a rule that a file defines; empty if the reason is unknown."""
    for diagnostic in reversed(book.diagnostics):
        if diagnostic.construct.partition(" ")[2] == rule:
            return f"it was refused when its file was loaded: {diagnostic}"
    behind = _behind_unclosed(rule, book)
    if behind:
        return behind
    place = find_rule(rule, book.files)
    if place is not None:
        lost = [str(diagnostic) for diagnostic in book.diagnostics if diagnostic.file == place.file]
        if lost:
            return f"{place} defines it, but the file was not loaded as a whole: {lost[0]}"
        return f"{place} defines it, and it was loaded, but it is gone: undefined later, or not loaded yet"
    loaded = {str(Path(file).resolve()) for file in book.files}
    unloaded_paths = (path for folder in book.folders for path in sorted(Path(folder).rglob("*.clp")))
    place = find_rule(rule, (str(path) for path in unloaded_paths if str(path.resolve()) not in loaded))
    return "" if place is None else f"{place} defines it, but the spec does not load that file"


def _behind_unclosed(rule: str, book: Rulebook) -> str:
    """Return that a rule follows an unclosed parenthesis; empty if it does not."""
    begin = re.compile(rf"^\s*\(defrule\s+{re.escape(rule)}(?![^\s()])", re.MULTILINE)
    for diagnostic in book.diagnostics:
        if diagnostic.code != UNCLOSED or diagnostic.line is None:
            continue
        try:
            text = Path(diagnostic.file).read_bytes().decode("utf-8", "surrogateescape")
        except OSError:
            continue
        match = begin.search(text)
        if match is not None and text.count("\n", 0, match.start() + 1) + 1 > diagnostic.line:
            return f"it is lost with what follows an unclosed parenthesis: {diagnostic}"
    return ""
