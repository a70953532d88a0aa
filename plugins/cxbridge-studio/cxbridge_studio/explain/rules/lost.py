"""The rules in an agent's files that the environment lacks: refused, or in files that are not loaded."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from cxbridge.clipstext.syntax import definitions
from cxbridge.printing import short_path
from cxbridge_studio.explain.rules.snapshot import Rulebook

_RULE = "defrule "


@dataclass(frozen=True, slots=True)
class LostRule:
    """A rule in a file that the environment lacks.

    :param text: the defrule; empty if unknown.
    :param why: a phrase that follows the rule's name.
    """

    name: str
    text: str
    why: str


def refused(book: Rulebook) -> dict[str, LostRule]:
    """Return the rules that CLIPS refused, by name."""
    lost_rules: dict[str, LostRule] = {}
    read: dict[str, dict[str, str]] = {}
    for diagnostic in book.diagnostics:
        name = diagnostic.construct.removeprefix(_RULE)
        if not diagnostic.construct.startswith(_RULE) or name in book.rules:
            continue
        if diagnostic.file not in read:
            read[diagnostic.file] = dict(_rules(Path(diagnostic.file))) if name not in book.refused else {}
        text = book.refused.get(name, "") or read[diagnostic.file].get(name, "")
        place = short_path(diagnostic.file) + ("" if diagnostic.line is None else f":{diagnostic.line}")
        reason = f"was refused when its file was loaded: {place}: {diagnostic.message} [{diagnostic.code}]"
        lost_rules[name] = LostRule(name, text, reason)
    return lost_rules


def unloaded(book: Rulebook) -> Iterator[LostRule]:
    """Yield the rules in the agent's folders whose files are not loaded."""
    loaded = {str(Path(file).resolve()) for file in book.files}
    for folder in book.folders:
        for path in sorted(Path(folder).rglob("*.clp")):
            if str(path.resolve()) not in loaded:
                for name, text in _rules(path):
                    if name not in book.rules:
                        yield LostRule(name, text, f"is in {short_path(path)}, which the spec does not load")


def _rules(path: Path) -> Iterator[tuple[str, str]]:
    try:
        text = path.read_bytes().decode("utf-8", "surrogateescape")
    except OSError:
        return
    for definition in definitions(text):
        if definition.kind == "defrule":
            yield definition.name, definition.node.text
