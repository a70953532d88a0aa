"""Differences in words: what an event is about, and in what two events differ."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceWrite,
    PlanActionTransition,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.compare.naming import Names
from cxbridge.trace.compare.tokens import PARTS, Key

_PLACEHOLDER: Final = re.compile(r"(?:gen|uuid|fact)#")


def subject_of(event: Event) -> str:
    """Return the goal, plan, skiller, interface that an event is about."""
    if isinstance(event, GoalTransition):
        return f"goal {event.goal} of class {event.goal_class}"
    if isinstance(event, PlanActionTransition):
        return f"plan {event.plan} of goal {event.goal}"
    if isinstance(event, SkillStatus):
        return f"skiller {event.skiller} of {event.env}"
    if isinstance(event, RuleFired):
        return f"rules of {event.env}"
    if isinstance(event, FactChange):
        return f"facts {event.template} of {event.env}"
    return event.uid if isinstance(event, InterfaceWrite) else ""


def time_words(late: float) -> str:
    """Return in words that an event of B is late, or early (less than 0), by so many seconds."""
    return f"another time: {abs(late):.6g} s {'later' if late > 0 else 'earlier'} in B"


def scope_of(key: Key) -> str:
    """Return what tells scenarios apart: the class of a goal, a rule, a skill, a template, an interface."""
    kind = str(key[0])
    if kind == "goal":
        return f"goal class {key[3]}"
    if kind == "plan-action":
        return f"action {key[5]}"
    if kind == "skill":
        return skill_scope(str(key[3]))
    if kind == "rule":
        return f"rule {key[2]}"
    return f"template {key[2]}" if kind == "fact" else f"interface {key[1]}"


def skill_scope(skill_string: str) -> str:
    """Return which skill a skill string calls; empty for none."""
    name = re.split(r"[({]", skill_string)[0].strip()
    return f"skill {name}" if name else ""


STRANGERS: Final = 0.5
"""Runs of which less than this part has partners are taken for runs of different scenarios."""

NAMED: Final = 5
"""So many classes, rules, skills are named that one run has alone."""


def judge(scopes_a: set[str], scopes_b: set[str]) -> list[str]:
    """Return a hint when two runs have too little in common to be of one scenario.

    :param scopes_a: what :func:`scope_of` says of the events of one run; ``scopes_b``: of the other.
    """
    every = (scopes_a | scopes_b) - {""}
    alike = len(scopes_a & scopes_b & every) / max(1, len(every))
    return [strangers(scopes_a, scopes_b)] if every and alike < STRANGERS else []


def strangers(scopes_a: set[str], scopes_b: set[str]) -> str:
    """Return in words that two runs look like runs of different scenarios, and what each has alone."""
    told = ["these look like runs of different scenarios"]
    for name, scopes in (("A", scopes_a - scopes_b), ("B", scopes_b - scopes_a)):
        listed = sorted(scope for scope in scopes if scope)
        more = f" and {len(listed) - NAMED} more" if len(listed) > NAMED else ""
        if listed:
            told.append(f"only {name} has {', '.join(listed[:NAMED])}{more}")
    return "; ".join(told)


def changed(one: Key, labels_one: Names, other: Key, labels_other: Names) -> str:
    """Return in words in what two events differ.

    :param labels_one: the names in it, by numbers that are the same for partners; ``labels_other``: likewise.
    """
    if one[0] != other[0]:
        return "another event"
    parts = PARTS[str(one[0])]
    named_one, named_other = _parts(one, labels_one), _parts(other, labels_other)
    differing = [part for part, a, b in zip(parts, named_one, named_other, strict=True) if a != b]
    if not differing or len(differing) > MANY:
        return "another event"
    return "another " + " and ".join(differing)


MANY: Final = 3
"""Events that differ in more parts than this are not called changed, but others."""


def _parts(key: Key, labels: Names) -> Iterator[tuple[str, Names]]:
    """Yield the parts of a key, each with the names in it."""
    at = 0
    for part in key[1:]:
        count = len(_PLACEHOLDER.findall(part))
        yield part, labels[at : at + count]
        at += count
