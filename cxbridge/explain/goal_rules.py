"""The rules that could move a goal on: those that match goals like it, and set a mode."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from cxbridge.errors import ClipsError
from cxbridge.explain.rules.condition import FieldConstraint, PatternCE
from cxbridge.explain.rules.parse import parse_rule

MOST_RULES: Final = 5
"""Rules that are named."""

_SPECIFIC: Final = {"class": 4, "sub-type": 2, "mode": 1}
_NAMES_MODE: Final = "(mode "


def rules_for(texts: Mapping[str, str], slots: Mapping[str, str]) -> list[str]:
    """Return the rules that could set another mode for a goal, the most specific first.

    :param texts: defrules by name.
    :param slots: of the goal: class, sub-type, mode.
    """
    found = []
    for name, text in texts.items():
        condition, _, actions = text.partition("=>")
        if slots["mode"] not in condition or _NAMES_MODE not in actions:
            continue
        try:
            ces = parse_rule(text).ces
        except ClipsError:
            continue
        scores = [score for ce in ces if isinstance(ce, PatternCE) and (score := _score(ce, slots))]
        if scores:
            found.append((-max(scores), name))
    return [name for _, name in sorted(found)][:MOST_RULES]


def _score(pattern: PatternCE, slots: Mapping[str, str]) -> int:
    """Return how closely a pattern is about a goal; 0 when it is not, or not for its mode."""
    if pattern.template != "goal" or not pattern.variable:
        return 0
    total = 0
    modes = False
    for part in pattern.parts:
        value = slots.get(part.slot)
        if value is None or len(part.fields) != 1:
            continue
        named, fits = _allows(part.fields[0], value)
        if not fits:
            return 0
        modes = modes or (part.slot == "mode" and named)
        total += _SPECIFIC[part.slot] if named else 0
    return total if modes else 0


def _allows(field: FieldConstraint, value: str) -> tuple[bool, bool]:
    """Return whether a constraint names a value, and whether it can fit; of functions the latter is hoped."""
    named = False
    fits = not field.alternatives
    for terms in field.alternatives:
        words = ["".join(node.text for node in term) for term in terms]
        if any(word == f"~{value}" for word in words):
            continue
        plain = [word for word in words if not word.startswith(("~", ":", "=", "?"))]
        if all(word == value for word in plain):
            fits = True
            named = named or bool(plain)
    return named, fits
