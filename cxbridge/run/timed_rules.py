"""Rules that time alone can activate: rules with a (time ...) pattern and all other facts present.

The check errs on one side: only a pattern without any matching fact excludes a rule. Joins, tests and negated
patterns count as satisfied.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import lru_cache
from typing import Final

from cxbridge.clipstext.condition import CE, GroupCE, PatternCE, condition_of
from cxbridge.clipstext.syntax import read
from cxbridge.executive.host.constructs import rule_texts
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import Value

TIME: Final = "time"
# Core rules that fire on each tick without further effect.
_TICKS: Final = frozenset({"time-retract", "blackboard-read"})

# The core rule that requests control of a Skiller periodically.
_CONTROL: Final = "skill-control-acquire"


def timed_rules(env: ClipsEnvironment, skillers: Collection[str]) -> Iterator[str]:
    """Yield the rules that can fire with no new facts except time.

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
    """Return the deftemplate of the first missing fact of a rule; empty if no fact is known to be missing."""
    for each in condition_of_rule(rule_texts(env).get(rule, "")):
        if isinstance(each, PatternCE) and not _may_hold(env, each):
            return each.template
    return ""


@lru_cache(maxsize=1024)  # a run asks about the same rules again and again
def condition_of_rule(text: str) -> tuple[CE, ...]:
    """Return the condition of a rule; empty if it is nested too deeply for the parser."""
    try:
        return tuple(ce for rule in read(text) for ce in condition_of(rule))
    except RecursionError:
        return ()


def _can_get_control(env: ClipsEnvironment, skillers: Collection[str]) -> bool:
    """Return whether a Skiller with an open control request exists."""
    # SkillerInterface may have no fact yet: the Skiller writes nothing until a client has control
    controls = (slots for _, _, slots in env.facts("skiller-control"))
    return any(slots["acquired"] == "FALSE" and str(slots["skiller"]) in skillers for slots in controls)


def _may_hold(env: ClipsEnvironment, element: CE) -> bool:
    """Return whether existing facts and any time fact may satisfy a conditional element."""
    if isinstance(element, GroupCE):
        if element.kind in ("and", "logical", "exists"):
            return all(_may_hold(env, item) for item in element.items)
        return element.kind != "or" or any(_may_hold(env, item) for item in element.items)
    if not isinstance(element, PatternCE) or element.template == TIME:
        return True
    wanted = _literals(element)
    return any(_fits(slots, wanted) for _, _, slots in env.facts(element.template))


def _literals(pattern: PatternCE) -> dict[str, frozenset[str]]:
    """Return the slots with literal symbols, and these symbols."""
    return {
        slot: words
        for slot, words in pattern.slots.items()
        if all(word[0].isalpha() for word in words)  # a number has several spellings
    }


def _fits(slots: Mapping[str, Value], wanted: Mapping[str, frozenset[str]]) -> bool:
    return all(
        name not in slots or isinstance(slots[name], tuple) or str(slots[name]) in values
        for name, values in wanted.items()
    )
