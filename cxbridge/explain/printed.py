"""Facts as CLIPS printed them, back to values. What has no quotes is a number, a fact address or a symbol."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.events import FactChange
from cxbridge.executive.host.values import Symbol, Value
from cxbridge.explain.snapshot import FactRef, FactRow, Template

_INTEGER = re.compile(r"[+-]?\d+\Z")
_FLOAT = re.compile(r"[+-]?(?:\d+\.\d*|\.?\d+)(?:[eE][+-]?\d+)?\Z")
_FACT = re.compile(r"<Fact-(\d+)>\Z")
_LARGEST = 2**63


def fields(text: str) -> tuple[Value, ...]:
    """Return the values in the text of a slot: blanks between them, quotes in strings not escaped."""
    found: list[Value] = []
    at = 0
    while at < len(text):
        if text[at] == " ":
            at += 1
        elif text[at] == '"':
            end = _string_end(text, at)
            found.append(text[at + 1 : end])
            at = end + 1
        else:
            end = text.find(" ", at)
            end = len(text) if end < 0 else end
            found.append(_atom(text[at:end]))
            at = end
    return tuple(found)


def _string_end(text: str, start: int) -> int:
    """Return where a string ends: at a quote that is the last, or before a blank and no loose quote."""
    at = start
    while (at := text.find('"', at + 1)) >= 0:
        rest = text[at + 1 :]
        if not rest or re.match(r" (?:\"|[^\s\"]+(?: |\Z))", rest):
            return at
    return len(text)


def _atom(text: str) -> Value:
    if _INTEGER.match(text) and abs(int(text)) < _LARGEST:
        return int(text)
    if _FLOAT.match(text):
        return float(text)
    address = _FACT.match(text)
    return FactRef(int(address[1])) if address else Symbol(text)


def rows_of(
    changes: Iterable[FactChange], templates: Mapping[str, Template]
) -> tuple[dict[str, Template], list[FactRow]]:
    """Return facts, and their templates: the known ones, and for others what the facts look like.

    Facts that cannot be read are left out.
    """
    parsed: list[tuple[FactChange, dict[str, tuple[Value, ...]] | None, tuple[Value, ...]]] = []
    slots: dict[str, dict[str, bool]] = {}
    ordered: set[str] = set()
    for change in changes:
        values, words = _parse(change, templates.get(change.template))
        if values is None and words is None:
            continue
        parsed.append((change, values, words or ()))
        if values is None:
            ordered.add(change.template)
        else:
            known = slots.setdefault(change.template, {})
            for slot, contents in values.items():
                known[slot] = known.get(slot, False) or len(contents) != 1
    all_templates = dict(templates)
    for name, flags in slots.items():
        all_templates.setdefault(name, Template(name, tuple(flags.items())))
    for name in ordered:
        all_templates.setdefault(name, Template(name, None))
    rows = []
    for change, values, words in parsed:
        row = _row(change, values, words, all_templates[change.template])
        if row is not None:
            rows.append(row)
    return all_templates, sorted(rows, key=lambda row: row.index)


def _parse(
    change: FactChange, template: Template | None
) -> tuple[dict[str, tuple[Value, ...]] | None, tuple[Value, ...] | None]:
    """Return the slots of a fact, or the words of an ordered one; neither when it cannot be read."""
    if template is None or template.slots is not None:
        try:
            _, texts = parse_fact(change.text)
        except FactSyntaxError:
            if template is not None:
                return None, None
        else:
            if texts or template is not None:
                return {slot: _slot(text, slot, template) for slot, text in texts.items()}, None
    body = change.text[1 + len(change.template) : -1].strip()
    return None, fields(body)


def _slot(text: str, slot: str, template: Template | None) -> tuple[Value, ...]:
    single = template is not None and (slot, False) in (template.slots or ())
    if single and len(text) > 1 and text[0] == text[-1] == '"':
        return (text[1:-1],)
    return fields(text)


def _row(
    change: FactChange,
    values: dict[str, tuple[Value, ...]] | None,
    words: tuple[Value, ...],
    template: Template,
) -> FactRow | None:
    if template.slots is None:
        return FactRow(change.index, template.name, (words,))
    if values is None:
        return None
    made: list[Value] = []
    for slot, multi in template.slots:
        contents = values.get(slot, ())
        if not multi and len(contents) != 1:
            contents = (Symbol("nil"),)
        made.append(contents if multi else contents[0])
    return FactRow(change.index, template.name, tuple(made))
