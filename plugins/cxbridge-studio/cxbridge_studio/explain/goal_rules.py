"""Finds the rules that can change a goal's mode, and rules that could if they were loaded or spelt right."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from typing import Final

from cxbridge.clipstext.condition import FieldConstraint, PatternCE, patterns
from cxbridge.errors import ClipsError
from cxbridge.suggestions import likeness
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.rules.lost import LostRule

MOST_RULES: Final = 5  # limit of listed rules

_SPECIFIC: Final = {"class": 4, "sub-type": 2, "mode": 1}
_NAMES_MODE: Final = "(mode "
_LIKE: Final = 0.7  # similarity above which a class is taken as a misspelling

_GOAL: Final = "goal"


def rules_for(texts: Mapping[str, str], slots: Mapping[str, str]) -> list[str]:
    """Return the rules that can change a goal's mode, the most specific first.

    :param texts: defrules by name.
    :param slots: class, sub-type and mode of the goal.
    """
    rules = []
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
            rules.append((-max(scores), name))
    return [name for _, name in sorted(rules)][:MOST_RULES]


def lost_rule_for(rules: Iterable[LostRule], slots: Mapping[str, str]) -> LostRule | None:
    """Return the first lost rule for goals of this class in this mode, or None.

    :param slots: class and mode of the goal.
    """
    for rule in rules:
        if slots["class"] in rule.text and any(
            _names(pattern, "class", slots["class"]) and _names(pattern, "mode", slots["mode"])
            for pattern in _patterns(rule.text)
        ):
            return rule
    return None


def misspelt_for(
    texts: Mapping[str, str], slots: Mapping[str, str], classes: Collection[str]
) -> tuple[str, str] | None:
    """Return a rule for goals in this mode that misspells the class, and the misspelt class; or None.

    :param texts: defrules by name.
    :param slots: class and mode of the goal.
    :param classes: the classes of existing goals, which are not misspelt.
    """
    for name, text in texts.items():
        if _GOAL not in text or slots["mode"] not in text.partition("=>")[0]:
            continue
        for pattern in _patterns(text):
            if _names(pattern, "mode", slots["mode"]) and not _names(pattern, "class", slots["class"]):
                for other in sorted(pattern.slots.get("class", ())):
                    if other not in classes and _is_like(other, slots["class"]):
                        return name, other
    return None


def makers(texts: Mapping[str, str], name: str) -> list[str]:
    """Return the rules that formulate goals of a class, or a goal with this id.

    :param texts: defrules by name.
    """
    word = re.compile(rf"\((?:class|id|goal-tree-assert-[\w-]+)\s+{re.escape(name)}(?![^\s()\"])")
    return [
        rule
        for rule, text in texts.items()
        if name in text and word.search(text.partition("=>")[2]) is not None
    ]


def _names(pattern: PatternCE, slot: str, value: str) -> bool:
    return value in pattern.slots.get(slot, ())


def _is_like(first_class: str, second_class: str) -> bool:
    return first_class != second_class and likeness(first_class, second_class) >= _LIKE


def _patterns(text: str) -> Iterator[PatternCE]:
    """Yield the patterns of a rule that match goals; none if the rule cannot be parsed."""
    try:
        ces = parse_rule(text).ces
    except ClipsError:
        return
    yield from (pattern for pattern in patterns(ces) if pattern.template == _GOAL)


def _score(pattern: PatternCE, slots: Mapping[str, str]) -> int:
    """Return how specifically a pattern matches a goal; 0 if it does not match, or names no mode."""
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
    """Return whether a constraint names a value, and whether it can match. Functions are taken to match."""
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
