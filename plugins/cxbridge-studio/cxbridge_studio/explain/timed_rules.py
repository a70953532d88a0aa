"""Finds rules that time alone may still activate in an idle agent."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import TYPE_CHECKING, Final

from cxbridge.clipstext.syntax import read_nodes
from cxbridge.run.stuck import TICK_RULES
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, parse_condition
from cxbridge_studio.constructs import read_rule_texts

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge.run.agent import Run

TIME_KEY: Final = "/clips-executive/assert-time-each-loop"

# The deftemplate of the fact with the current time, which the executive asserts in each cycle if TIME_KEY is
# true.
_TIME_TEMPLATE: Final = "time"

# The core rule that requests control of a Skiller periodically.
_CONTROL_RULE: Final = "skill-control-acquire"


def has_time_facts(agent: Run) -> bool:
    """Return whether each cycle asserts a time fact."""
    return agent.config.get_bool(TIME_KEY, default=False)


def has_timed_rule(agent: Run) -> bool:
    """Return whether an agent has a rule with a pattern for ``time`` facts whose other facts exist.

    In doubt a rule counts, which only delays the end of the run until the timeout. A rule does not count if
    one of its patterns has no matching fact. Joins, tests and negated patterns count as satisfied.
    """
    if not has_time_facts(agent):
        return False
    env = agent.executive.env
    for name, text in read_rule_texts(env).items():
        # These rules of the core fire in each cycle, without further effect.
        if f"({_TIME_TEMPLATE} " not in text or name in TICK_RULES:
            continue
        if name == _CONTROL_RULE and not _can_get_control(agent):
            continue
        if all(_may_hold(env, element) for element in parse_rule_condition(text)):
            return True
    return False


def find_missing_template(env: ClipsEnvironment, rule: str) -> str:
    """Return the deftemplate of the first missing fact of a rule; empty if no fact is known to be missing."""
    for element in parse_rule_condition(read_rule_texts(env).get(rule, "")):
        if isinstance(element, PatternCE) and not _may_hold(env, element):
            return element.template
    return ""


@lru_cache(maxsize=1024)  # each check of a run parses the same rules, of which an agent has hundreds
def parse_rule_condition(text: str) -> tuple[CE, ...]:
    """Return the condition of a defrule's text; empty if the text is nested too deeply for the parser."""
    try:
        return tuple(element for node in read_nodes(text) for element in parse_condition(node))
    except RecursionError:
        return ()


def _can_get_control(agent: Run) -> bool:
    """Return whether a Skiller with an open control request exists."""
    # The facts of SkillerInterface do not answer this: a Skiller writes nothing until a client has control.
    interfaces = agent.board.list_all()
    skillers = {
        interface.id
        for interface in interfaces
        if interface.type == "SkillerInterface" and interface.has_writer
    }
    controls = (slots for _, _, slots in agent.executive.env.facts("skiller-control"))
    return any(slots["acquired"] == "FALSE" and str(slots["skiller"]) in skillers for slots in controls)


def _may_hold(env: ClipsEnvironment, element: CE) -> bool:
    """Return whether existing facts and any time fact may satisfy a conditional element."""
    if isinstance(element, GroupCE):
        if element.kind in ("and", "exists"):
            return all(_may_hold(env, item) for item in element.items)
        return element.kind != "or" or any(_may_hold(env, item) for item in element.items)
    if not isinstance(element, PatternCE) or element.template == _TIME_TEMPLATE:
        return True
    symbols_by_slot = {
        slot: words
        for slot, words in element.words_by_slot.items()
        if all(word[0].isalpha() for word in words)  # not for numbers, which have several spellings
    }
    return any(_has_symbols(slots, symbols_by_slot) for _, _, slots in env.facts(element.template))


def _has_symbols(slots: Mapping[str, Value], symbols_by_slot: Mapping[str, frozenset[str]]) -> bool:
    """Return whether a fact has one of the permitted symbols in each of these slots."""
    # Multislots, and slots that the fact lacks, count as matches, because in doubt a rule counts.
    return all(
        slot not in slots or isinstance(slots[slot], tuple) or str(slots[slot]) in symbols
        for slot, symbols in symbols_by_slot.items()
    )
