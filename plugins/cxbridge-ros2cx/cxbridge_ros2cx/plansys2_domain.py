"""Domains that PlanSys2 would reject although cxbridge's parser and planners accept them.

PlanSys2's domain expert has its own parser, which fails at unknown constructs. Its rules are in
docs/evidence/ros2cx.md. Source: plansys2_pddl_parser, Domain.hpp, Action.cpp and TemporalAction.cpp.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Final

from cxbridge.errors import PddlError
from cxbridge.executive.pddl.brackets import BracketWord, Group, Item, read_items

# requirements that PlanSys2 knows, without the colon
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

# keywords in formulas that PlanSys2 does not know
_UNKNOWN: Final = frozenset({"preference", "scale-down", "scale-up"})

_KEYS: Final = {
    ":action": (":parameters", ":precondition", ":effect"),
    ":durative-action": (":parameters", ":duration", ":condition", ":effect"),
}
_OPTIONAL: Final = (":precondition", ":condition")
_TIMES: Final = (("at", "start"), ("over", "all"), ("at", "end"))


def why_refused(file: str) -> PddlError | None:
    """Return PlanSys2's reason to reject the domain in a file, with the line; None if accepted."""
    try:
        text = Path(file).read_text(encoding="utf-8", errors="surrogateescape")
        reasons = _reasons(read_items(text.lower(), file))
    except (OSError, PddlError):
        return None  # the parser has accepted this file before, so the fault is not the domain's
    for item, reason in reasons:
        return PddlError(f"PlanSys2 would refuse this domain: {reason}", file=file, line=item.position.line)
    return None


def _reasons(items: tuple[Item, ...]) -> Iterator[tuple[Item, str]]:
    """Yield PlanSys2's reasons to reject a domain, each with the word or list at fault."""
    sections = [item for define in _groups(items) for item in _groups(define.items)]
    requirements = [section for section in sections if section.head == ":requirements"]
    for section in requirements:
        for word in section.items[1:]:
            if isinstance(word, BracketWord) and word.text.removeprefix(":") not in REQUIREMENTS:
                yield word, f"it knows no requirement {word.text}"
    typed = any(word.text == ":typing" for item in requirements for word in _words(item.items))
    heads: set[str] = set()  # keywords of the sections before the present section
    for section in sections:
        if section.head == ":types" and not typed:
            yield section, "it needs the requirement :typing where there are types; :adl does not include it"
        if section.head in _KEYS:
            if ":predicates" not in heads:
                yield section, "it needs predicates before the first action"
            yield from _action_reasons(section)
        heads.add(section.head)


def _action_reasons(action: Group) -> Iterator[tuple[Item, str]]:
    """Yield errors about an action: its keys have a fixed order, and only the condition is optional."""
    values = dict(zip(action.items[2::2], action.items[3::2], strict=False))
    keys = [word.text for word in values if isinstance(word, BracketWord)]
    expected = [key for key in _KEYS[action.head] if key in keys or key not in _OPTIONAL]
    if keys != expected:
        yield action, f"an action must have {', '.join(expected)}, in this order, and nothing else"
        return
    for key, value in values.items():
        if isinstance(key, BracketWord) and isinstance(value, Group):
            yield from _value_reasons(key.text, value, durative=action.head == ":durative-action")


def _value_reasons(key: str, value: Group, *, durative: bool) -> Iterator[tuple[Item, str]]:
    """Yield errors about the value of an action's key."""
    if key == ":duration":
        words = [word.text for word in _words(value.items[:2])]
        if words != ["=", "?duration"]:
            yield value, "a duration must be (= ?duration VALUE)"
    elif key != ":parameters":
        for group in _all_groups(value):
            if group.head in _UNKNOWN:
                yield group, f"it knows no '{group.head}'"
        if durative:
            # an empty list is an empty condition or effect
            conjuncts = _groups(value.items) if value.head == "and" else [value] * bool(value.items)
            for conjunct in conjuncts:
                words = [word.text for word in _words(conjunct.items[:2])]
                if tuple(words) not in _TIMES:
                    yield (
                        conjunct,
                        "parts of a durative action are (at start ...), (over all ...), (at end ...)",
                    )


def _groups(items: tuple[Item, ...]) -> list[Group]:
    return [item for item in items if isinstance(item, Group)]


def _words(items: tuple[Item, ...]) -> list[BracketWord]:
    return [item for item in items if isinstance(item, BracketWord)]


def _all_groups(group: Group) -> Iterator[Group]:
    yield group
    for nested in _groups(group.items):
        yield from _all_groups(nested)
