"""Finds the rules that an agent's files define and its environment lacks, with the reasons.

CLIPS refused such a rule, an unclosed parenthesis before the rule swallowed it, the rule was undefined later,
or the file is not loaded.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from msgspec.structs import replace

from cxbridge.clipstext.syntax import definitions, rule_lines
from cxbridge.executive.host.loading import UNCLOSED
from cxbridge.printing import short_path
from cxbridge_studio.explain.rules.snapshot import Rulebook

SourceLine = tuple[str, int]
"""The file and the line of a construct."""


@dataclass(frozen=True, slots=True)
class MissingRule:
    """A rule in a file that the environment lacks.

    :param text: the defrule; empty if unknown.
    :param reason: the reason, as the end of a sentence that begins with the rule's name.
    """

    name: str
    text: str
    reason: str


def find_refused_rules(rulebook: Rulebook) -> dict[str, MissingRule]:
    """Return the rules that CLIPS refused, by name."""
    missing_rules: dict[str, MissingRule] = {}
    read_rules = cache(lambda file: dict(_read_rules(file)))  # a file with many mistakes is read only once
    for diagnostic in rulebook.diagnostics:
        kind, _, name = diagnostic.construct.partition(" ")
        # A file may define a rule again after CLIPS refused the first definition.
        if kind == "defrule" and name not in rulebook.rules:
            text = rulebook.refused_texts.get(name) or read_rules(diagnostic.file).get(name, "")
            mistake = replace(diagnostic, file=short_path(diagnostic.file), construct="")
            missing_rules[name] = MissingRule(name, text, f"was refused when its file was loaded: {mistake}")
    return missing_rules


def find_unloaded_rules(rulebook: Rulebook) -> Iterator[MissingRule]:
    """Yield the rules in the agent's folders whose files are not loaded."""
    return (
        MissingRule(name, text, f"is in {short_path(file)}, which the spec does not load")
        for file in _find_unloaded_files(rulebook)
        for name, text in _read_rules(file)
        if name not in rulebook.rules
    )


def explain_missing_rule(rule: str, rulebook: Rulebook) -> str:
    """Return why an environment lacks a rule that a file defines; empty if the reason is unknown."""
    # The last diagnostic counts: it is about the definition that would have replaced the earlier ones.
    for diagnostic in reversed(rulebook.diagnostics):
        if diagnostic.construct == f"defrule {rule}":
            return f"it was refused when its file was loaded: {diagnostic}"
    if swallowed_reason := _explain_swallowed_rule(rule, rulebook):
        return swallowed_reason
    if (position := find_rule(rule, rulebook.files)) is not None:
        file, _ = position
        messages = (str(diagnostic) for diagnostic in rulebook.diagnostics if diagnostic.file == file)
        reason = next(messages, "it was undefined later, or is not loaded yet")
        return f"{format_position(position)} defines it, but it is gone: {reason}"
    if (position := find_rule(rule, _find_unloaded_files(rulebook))) is not None:
        return f"{format_position(position)} defines it, but the spec does not load that file"
    return ""


def format_position(position: SourceLine) -> str:
    file, line = position
    return f"{short_path(file)}:{line}"


def find_rule(rule: str, files: Iterable[str]) -> SourceLine | None:
    """Return the position of a rule, the last if several files define it; None if no file does."""
    position = None
    for file in dict.fromkeys(files):
        text = _read_text(file)
        # Parsing is slow, and most files lack the rule: the search for the word comes first.
        if rule in text and (line := rule_lines(text).get(rule)):
            position = file, line
    return position


def _explain_swallowed_rule(rule: str, rulebook: Rulebook) -> str:
    """Return which unclosed parenthesis swallowed a rule, as a sentence; empty if none did."""
    rule_start = re.compile(rf"^\s*\(defrule\s+{re.escape(rule)}(?![^\s()])", re.MULTILINE)
    for diagnostic in rulebook.diagnostics:
        if diagnostic.code == UNCLOSED and diagnostic.line is not None:
            text = _read_text(diagnostic.file)
            match = rule_start.search(text)
            if match is not None and text.count("\n", 0, match.start() + 1) + 1 > diagnostic.line:
                return f"it is swallowed by an unclosed parenthesis: {diagnostic}"
    return ""


def _find_unloaded_files(rulebook: Rulebook) -> Iterator[str]:
    """Yield the CLIPS files in the agent's folders that are not loaded."""
    loaded_files = {str(Path(file).resolve()) for file in rulebook.files}
    return (
        str(path)
        for folder in rulebook.folders
        for path in sorted(Path(folder).rglob("*.clp"))
        if str(path.resolve()) not in loaded_files
    )


def _read_rules(file: str) -> Iterator[tuple[str, str]]:
    """Yield the name and the text of each rule in a file."""
    return (
        (definition.name, definition.node.text)
        for definition in definitions(_read_text(file))
        if definition.kind == "defrule"
    )


def _read_text(file: str) -> str:
    """Return the text of a file; empty if unreadable: a recording may name files of another machine."""
    try:
        return Path(file).read_bytes().decode("utf-8", "surrogateescape")
    except OSError:
        return ""
