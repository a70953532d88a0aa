"""Finds the rules that can change a goal's mode, and rules that could if they were loaded or spelt right.

The rules are known as text only, so each condition is compared with the goal's class, sub-type and mode, word
by word. Tests and functions, which only CLIPS can evaluate, count as matches.
"""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Final

from cxbridge.errors import ClipsError
from cxbridge.suggestions import likeness
from cxbridge_studio.agent.condition import PatternCE, find_patterns
from cxbridge_studio.agent.rule import parse_rule
from cxbridge_studio.explain.rules.missing import MissingRule

MAX_RULES: Final = 5  # limit of the listed rules

# The weights of the slots that a pattern names: the class says more than all other slots together.
_SLOT_WEIGHTS: Final = {"class": 4, "sub-type": 2, "mode": 1}
# The start of a call of a function that plans for a goal: the plan moves the goal to EXPANDED.
_PLANNING_CALL: Final = "(planner-plan"
# The minimum similarity with which a class counts as a misspelling; chosen freely, stricter than MIN_LIKENESS
# of suggestions.
_MIN_LIKENESS: Final = 0.7


def find_mode_changing_rules(texts: Mapping[str, str], slots: Mapping[str, str]) -> list[str]:
    """Return the names of the rules that can change a goal's mode, at most :data:`MAX_RULES`.

    The most specific rule comes first. A rule changes the mode itself, or calls a planner.

    :param texts: the defrules by name.
    :param slots: the class, sub-type and mode of the goal.
    """
    ranked_names = []
    for name, text in texts.items():
        condition, _, actions = text.partition("=>")
        # Parsing is slow, and an agent has hundreds of rules: the search for words comes first.
        is_planning = _PLANNING_CALL in actions
        if slots["mode"] not in condition or not (is_planning or "(mode " in actions):
            continue
        with suppress(ClipsError):  # a rule that cannot be parsed cannot be compared
            # Only top-level patterns: the rule cannot change a goal below `not` or `exists`. It modifies only
            # a goal with a fact variable.
            patterns = (
                ce
                for ce in parse_rule(text).ces
                if isinstance(ce, PatternCE) and (ce.variable or is_planning)
            )
            if specificity := max((_compute_specificity(ce, slots) for ce in patterns), default=0):
                ranked_names.append((-specificity, name))
    return [name for _, name in sorted(ranked_names)][:MAX_RULES]


def find_missing_rule(rules: Iterable[MissingRule], slots: Mapping[str, str]) -> MissingRule | None:
    """Return the first missing rule for goals of a class in a mode; None if there is none.

    :param slots: the class and mode of the goal.
    """
    return next(
        (
            rule
            for rule in rules
            if slots["class"] in rule.text
            and any(
                _names_value(pattern, "class", slots["class"])
                and _names_value(pattern, "mode", slots["mode"])
                for pattern in _find_goal_patterns(rule.text)
            )
        ),
        None,
    )


def find_misspelt_rules(
    texts: Mapping[str, str], slots: Mapping[str, str], classes: Collection[str]
) -> Iterator[tuple[str, str]]:
    """Yield the rules for goals in a mode that misspell the class, each with the misspelt class.

    :param texts: the defrules by name.
    :param slots: the class and mode of the goal.
    :param classes: the classes of existing goals, which are not misspelt.
    """
    for name, text in texts.items():
        if "goal" not in text or slots["mode"] not in text.partition("=>")[0]:
            continue
        for pattern in _find_goal_patterns(text):
            named_classes = pattern.words_by_slot.get("class", frozenset())
            if _names_value(pattern, "mode", slots["mode"]) and slots["class"] not in named_classes:
                yield from (
                    (name, goal_class)
                    for goal_class in sorted(named_classes.difference(classes))
                    if likeness(goal_class, slots["class"]) >= _MIN_LIKENESS
                )


def find_formulating_rules(texts: Mapping[str, str], name: str) -> list[str]:
    """Return the names of the rules that formulate goals with a name.

    :param texts: the defrules by name.
    :param name: a class or an id of goals.
    """
    # This name follows the name of a slot, or the core's function that asserts a tree of goals.
    formulation = re.compile(rf"\((?:class|id|goal-tree-assert-[\w-]+)\s+{re.escape(name)}(?![^\s()\"])")
    return [
        rule
        for rule, text in texts.items()
        if name in text and formulation.search(text.partition("=>")[2]) is not None
    ]


def _names_value(pattern: PatternCE, slot: str, value: str) -> bool:
    """Return whether a pattern names a value of a slot."""
    return value in pattern.words_by_slot.get(slot, ())


def _find_goal_patterns(text: str) -> Iterator[PatternCE]:
    """Yield the patterns of a rule that match goals; none if the rule cannot be parsed."""
    with suppress(ClipsError):
        yield from (pattern for pattern in find_patterns(parse_rule(text).ces) if pattern.template == "goal")


def _compute_specificity(pattern: PatternCE, slots: Mapping[str, str]) -> int:
    """Return the sum of the weights of the slots in which a pattern names a goal's value.

    The sum is 0 if the pattern does not match the goal, or names no mode.
    """
    if pattern.template != "goal":
        return 0
    named_slots = _SLOT_WEIGHTS.keys() & pattern.words_by_slot
    if "mode" not in named_slots or not all(_names_value(pattern, slot, slots[slot]) for slot in named_slots):
        return 0
    return sum(_SLOT_WEIGHTS[slot] for slot in named_slots)
