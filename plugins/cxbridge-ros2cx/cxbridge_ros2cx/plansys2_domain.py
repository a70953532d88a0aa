"""Finds the reason for which PlanSys2, the planning system of ROS 2, would reject a domain.

The parser and the planners of cxbridge accept more domains than PlanSys2, whose domain expert has a separate
parser that fails at unknown constructs. docs/evidence/ros2cx.md lists the rules of that parser. Sources:
plansys2_pddl_parser, Domain.hpp, Action.cpp and TemporalAction.cpp.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item, read_items

# requirements that PlanSys2 supports, without the colon
REQUIREMENTS: Final = frozenset(
    {
        "action-cost",
        "adl",
        "conditional-effects",
        "derived-predicates",
        "disjunctive-preconditions",
        "durative-actions",
        "equality",
        "existential-preconditions",
        "fluents",
        "negative-preconditions",
        "non-deterministic",
        "strips",
        "typing",
        "universal-preconditions",
    }
)

# keywords of PDDL formulas at which the parser of PlanSys2 fails
_UNKNOWN_KEYWORDS: Final = frozenset({"preference", "scale-down", "scale-up"})

# the keys of an action in the order that PlanSys2 requires
_ACTION_KEYS: Final = {
    ":action": (":parameters", ":precondition", ":effect"),
    ":durative-action": (":parameters", ":duration", ":condition", ":effect"),
}
_OPTIONAL_KEYS: Final = (":precondition", ":condition")
_TIME_SPECIFIERS: Final = (("at", "start"), ("over", "all"), ("at", "end"))


def find_domain_error(file: str) -> PddlError | None:
    """Return the reason for which PlanSys2 would reject the domain in a file, or None if it would not."""
    try:
        text = Path(file).read_text(encoding="utf-8", errors="surrogateescape")
        faults = _find_faults(read_items(text.lower(), file))
    except (OSError, PddlError):
        # cxbridge has parsed this file before, so an error means that the file has changed since
        return None
    for item, reason in faults:
        return PddlError(f"PlanSys2 would refuse this domain: {reason}", file=file, line=item.position.line)
    return None


def _find_faults(items: tuple[Item, ...]) -> Iterator[tuple[Item, str]]:
    """Yield the faults of a domain, each with the word or list at fault."""
    sections = [item for definition in _filter_groups(items) for item in _filter_groups(definition.items)]
    requirements = [section for section in sections if section.head == ":requirements"]
    for section in requirements:
        for word in section.items[1:]:
            if isinstance(word, BracketWord) and word.text.removeprefix(":") not in REQUIREMENTS:
                yield word, f"it does not support the requirement {word.text}"
    has_typing = any(word.text == ":typing" for item in requirements for word in _filter_words(item.items))
    section_keywords: set[str] = set()  # the keywords of the sections before the current section
    for section in sections:
        if section.head == ":types" and not has_typing:
            yield section, "it needs the requirement :typing where there are types; :adl does not include it"
        if section.head in _ACTION_KEYS:
            if ":predicates" not in section_keywords:
                yield section, "it needs predicates before the first action"
            yield from _find_action_faults(section)
        section_keywords.add(section.head)


def _find_action_faults(action: Group) -> Iterator[tuple[Item, str]]:
    """Yield the faults of an action: its keys have a fixed order, and only the condition is optional."""
    # items: the keyword, the name, then pairs of key and value; not strict, since the last value may be
    # missing
    values_by_key = dict(zip(action.items[2::2], action.items[3::2], strict=False))
    key_texts = [word.text for word in values_by_key if isinstance(word, BracketWord)]
    expected_keys = [
        key for key in _ACTION_KEYS[action.head] if key in key_texts or key not in _OPTIONAL_KEYS
    ]
    if key_texts != expected_keys:
        yield action, f"an action must have {', '.join(expected_keys)}, in this order, and nothing else"
        return
    for key, value in values_by_key.items():
        if isinstance(key, BracketWord) and isinstance(value, Group):
            yield from _find_value_faults(key.text, value, durative=action.head == ":durative-action")


def _find_value_faults(key: str, value: Group, *, durative: bool) -> Iterator[tuple[Item, str]]:
    """Yield the faults of a value in an action."""
    if key == ":duration":
        words = [word.text for word in _filter_words(value.items[:2])]
        if words != ["=", "?duration"]:
            yield value, "a duration must be (= ?duration VALUE)"
    elif key != ":parameters":
        for group in _find_all_groups(value):
            if group.head in _UNKNOWN_KEYWORDS:
                yield group, f"it does not support '{group.head}'"
        if durative:
            # an empty list is an empty condition or effect
            conjuncts = _filter_groups(value.items) if value.head == "and" else [value] * bool(value.items)
            for conjunct in conjuncts:
                words = [word.text for word in _filter_words(conjunct.items[:2])]
                if tuple(words) not in _TIME_SPECIFIERS:
                    yield (
                        conjunct,
                        "parts of a durative action are (at start ...), (over all ...), (at end ...)",
                    )


def _filter_groups(items: tuple[Item, ...]) -> list[Group]:
    return [item for item in items if isinstance(item, Group)]


def _filter_words(items: tuple[Item, ...]) -> list[BracketWord]:
    return [item for item in items if isinstance(item, BracketWord)]


def _find_all_groups(group: Group) -> Iterator[Group]:
    yield group
    for nested in _filter_groups(group.items):
        yield from _find_all_groups(nested)
