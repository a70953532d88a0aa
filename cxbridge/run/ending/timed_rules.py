"""Which rules time alone can activate: those with a pattern of (time ...) that lack no other fact.

The proof is one-sided: a rule is left out only when a pattern of it has no fact. Joins, tests and negated
patterns are taken to be fulfilled.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from typing import Final

from cxbridge.clipstext.condition import CE, FieldConstraint, GroupCE, PatternCE
from cxbridge.clipstext.rule import parse_rule
from cxbridge.errors import ClipsError
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

    :param skillers: the names of the Skillers that are there.
    """
    for name, text in rule_texts(env).items():
        if f"({TIME} " not in text or name in _TICKS:
            continue
        if name == _CONTROL and not _can_get_control(env, skillers):
            continue
        try:
            ces = parse_rule(text).ces
        except ClipsError:
            yield name
            continue
        if all(_may_hold(env, each) for each in ces):
            yield name


def lacking(env: ClipsEnvironment, rule: str) -> str:
    """Return the deftemplate of the first fact that a rule lacks; empty when it lacks none that is sure."""
    text = rule_texts(env).get(rule, "")
    try:
        ces = parse_rule(text).ces if text else ()
    except ClipsError:
        return ""
    for each in ces:
        if isinstance(each, PatternCE) and not _may_hold(env, each):
            return each.template
    return ""


def _can_get_control(env: ClipsEnvironment, skillers: Collection[str]) -> bool:
    """Whether a Skiller that is asked for control is there.

    It may be there without a fact of its interface: until somebody has control it writes nothing.
    """
    controls = (slots for _, _, slots in env.facts("skiller-control"))
    return any(slots["acquired"] == "FALSE" and str(slots["skiller"]) in skillers for slots in controls)


def _may_hold(env: ClipsEnvironment, element: CE) -> bool:
    """Whether facts that are there, and any time, may fulfil a conditional element."""
    if isinstance(element, GroupCE):
        if element.kind in ("and", "logical", "exists"):
            return all(_may_hold(env, each) for each in element.items)
        return element.kind != "or" or any(_may_hold(env, each) for each in element.items)
    if not isinstance(element, PatternCE) or element.template == TIME:
        return True
    wanted = dict(_literals(element))
    return any(_fits(slots, wanted) for _, _, slots in env.facts(element.template))


def _literals(pattern: PatternCE) -> Iterator[tuple[str, frozenset[str]]]:
    """Yield the slots whose values are written out, with these values."""
    for part in pattern.parts:
        if part.slot and len(part.fields) == 1 and (values := _words(part.fields[0])):
            yield part.slot, values


def _words(field: FieldConstraint) -> frozenset[str]:
    """Return the symbols and strings, one of which a field must have; empty when it may have others."""
    if field.binder not in ("", "?"):
        return frozenset()
    words = set()
    for terms in field.alternatives:
        if len(terms) != 1 or len(terms[0]) != 1:
            return frozenset()
        word = terms[0][0].text
        if not word.startswith('"') and not word[0].isalpha():
            return frozenset()
        words.add(word.strip('"'))
    return frozenset(words)


def _fits(slots: Mapping[str, Value], wanted: Mapping[str, frozenset[str]]) -> bool:
    return all(
        name not in slots or isinstance(slots[name], tuple) or str(slots[name]) in values
        for name, values in wanted.items()
    )
