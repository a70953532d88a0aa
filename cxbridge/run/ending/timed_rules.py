"""Which rules time alone can activate: those with a pattern of (time ...) that lack no other fact.

The proof is one-sided: a rule is left out only when a pattern of it has no fact. Joins, tests and negated
patterns are taken to be fulfilled.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, condition_of
from cxbridge.clipstext.syntax import read
from cxbridge.executive.host.constructs import rule_texts
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Value

TIME: Final = "time"
_TICKS: Final = frozenset({"time-retract", "blackboard-read"})
"""The rules of the core that fire on each tick, and begin nothing by themselves."""

_CONTROL: Final = "skill-control-acquire"
"""The rule of the core that asks a Skiller for control, again and again."""


def timed_rules(env: ClipsEnvironment, skillers: Collection[str]) -> Iterator[str]:
    """Yield the rules that may fire some day though no other fact than that of the time comes.

    :param skillers: the names of the existing Skillers.
    """
    for name, text in rule_texts(env).items():
        if f"({TIME} " not in text or name in _TICKS:
            continue
        if name == _CONTROL and not _can_get_control(env, skillers):
            continue
        if all(_may_hold(env, each) for each in condition_of_rule(text)):
            yield name


def lacking(env: ClipsEnvironment, rule: str) -> str:
    """Return the deftemplate of the first fact that a rule lacks; empty when it lacks none that is sure."""
    for each in condition_of_rule(rule_texts(env).get(rule, "")):
        if isinstance(each, PatternCE) and not _may_hold(env, each):
            return each.template
    return ""


def condition_of_rule(text: str) -> tuple[CE, ...]:
    """Return the condition of a rule; nothing of it when it is nested too deep to be read."""
    try:
        return tuple(ce for rule in read(text) for ce in condition_of(rule))
    except RecursionError:
        return ()


def _can_get_control(env: ClipsEnvironment, skillers: Collection[str]) -> bool:
    """Whether a Skiller that is asked for control exists.

    A Skiller may exist without a fact of its interface: it writes nothing until a client has control.
    """
    controls = (slots for _, _, slots in env.facts("skiller-control"))
    return any(slots["acquired"] == "FALSE" and str(slots["skiller"]) in skillers for slots in controls)


def _may_hold(env: ClipsEnvironment, element: CE) -> bool:
    """Whether existing facts, and any time, may fulfil a conditional element."""
    if isinstance(element, GroupCE):
        if element.kind in ("and", "logical", "exists"):
            return all(_may_hold(env, each) for each in element.items)
        return element.kind != "or" or any(_may_hold(env, each) for each in element.items)
    if not isinstance(element, PatternCE) or element.template == TIME:
        return True
    wanted = _literals(element)
    return any(_fits(slots, wanted) for _, _, slots in env.facts(element.template))


def _literals(pattern: PatternCE) -> dict[str, frozenset[str]]:
    """Return the slots whose values are words that are written out, with these words."""
    return {
        slot: words
        for slot, words in pattern.slots.items()
        if all(word[0].isalpha() for word in words)  # a number may be written in several ways
    }


def _fits(slots: Mapping[str, Value], wanted: Mapping[str, frozenset[str]]) -> bool:
    return all(
        name not in slots or isinstance(slots[name], tuple) or str(slots[name]) in values
        for name, values in wanted.items()
    )
