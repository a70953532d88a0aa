"""Parses the printed facts of a recording into values, to match rules with them.

A recording may lack the deftemplate of a fact, such as the template of an interface. Then the slots come from
the printed facts.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clipstext.values import NIL, Value
from cxbridge.events import FactChange
from cxbridge.executive.host.facts.copying import FactRow, FactTemplate
from cxbridge.history.transitions import unquote
from cxbridge_studio.explain.slot_values import parse_values

_ORDERED_FIELDS = ""  # the key for the fields of an ordered fact, in place of the name of a slot


def parse_rows(
    changes: Iterable[FactChange], templates: Mapping[str, FactTemplate]
) -> tuple[dict[str, FactTemplate], list[FactRow]]:
    """Return deftemplates by name, and the parsable facts, sorted by their indices.

    The result has all known deftemplates, and those that are derived from the facts.

    :param changes: the assertions of the facts.
    :param templates: the known deftemplates by name.
    """
    parsed_facts = [
        (change, slots)
        for change in changes
        if (slots := _parse_slots(change, templates.get(change.template))) is not None
    ]
    # Whether a slot is a multislot, by template and slot.
    slot_kinds_by_template: dict[str, dict[str, bool]] = {}
    for change, slots in parsed_facts:
        is_multislot_by_slot = slot_kinds_by_template.setdefault(change.template, {})
        for slot, values in slots.items():
            if slot != _ORDERED_FIELDS:
                # A slot that has no value or several values in any fact is a multislot.
                is_multislot_by_slot[slot] = is_multislot_by_slot.get(slot, False) or len(values) != 1
    all_templates = {
        name: FactTemplate(name, tuple(is_multislot_by_slot.items()) or None)
        for name, is_multislot_by_slot in slot_kinds_by_template.items()
    } | dict(templates)
    rows = (_make_row(change, slots, all_templates[change.template]) for change, slots in parsed_facts)
    return all_templates, sorted(filter(None, rows), key=lambda row: row.index)


def _parse_slots(change: FactChange, template: FactTemplate | None) -> Mapping[str, tuple[Value, ...]] | None:
    """Return the values by slot; the fields of an ordered fact have the key :data:`_ORDERED_FIELDS`.

    The result is None if the fact does not fit its template.
    """
    if template is None or template.slots is not None:
        try:
            _, texts = parse_fact(change.text)
        except FactSyntaxError:
            if template is not None:
                return None
            # Without a template, the fact may be an ordered fact such as ``(at 1 2)``.
        else:
            # Without a template, a fact without slots such as ``(done)`` counts as ordered.
            if texts or template is not None:
                return {slot: _parse_slot_values(text, slot, template) for slot, text in texts.items()}
    # An ordered fact: its fields are between ``(TEMPLATE `` and ``)``.
    return {_ORDERED_FIELDS: parse_values(change.text[1 + len(change.template) : -1].strip())}


def _parse_slot_values(text: str, slot: str, template: FactTemplate | None) -> tuple[Value, ...]:
    """Return the values of a slot.

    A recording may print strings without escaping their quotes, so a single value ends at the last quote.
    """
    is_single = template is not None and (slot, False) in (template.slots or ())
    return (unquote(text),) if is_single and unquote(text) != text else parse_values(text)


def _make_row(
    change: FactChange, slots: Mapping[str, tuple[Value, ...]], template: FactTemplate
) -> FactRow | None:
    """Return the row of a fact; None if an ordered fact has the template of facts with slots."""
    if template.slots is None:
        return FactRow(change.index, template.name, (slots.get(_ORDERED_FIELDS, ()),))
    if _ORDERED_FIELDS in slots:
        return None
    values = (
        slots.get(slot, ()) if is_multislot else _take_single(slots.get(slot, ()))
        for slot, is_multislot in template.slots
    )
    return FactRow(change.index, template.name, tuple(values))


def _take_single(values: tuple[Value, ...]) -> Value:
    """Return the value of a single slot; ``nil`` if the recording lacks it, or has several values."""
    return values[0] if len(values) == 1 else NIL
