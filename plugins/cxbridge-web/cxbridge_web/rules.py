"""Queries of a CLIPS environment: counts, rules and agenda."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from clips._clips import lib

from cxbridge.executive.host.capi import NULL, CData, decode
from cxbridge_web.paging import ListPart, Window, has_text, matches

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment

MOST_ACTIVATIONS: Final = 1000  # limit of activations in one answer


def census(env: ClipsEnvironment) -> dict[str, int]:
    """Return the numbers of facts, rules and activations."""
    with env.lock:
        return {
            "facts": _count(env, lib.GetNextFact),
            "rules": _count(env, lib.GetNextDefrule),
            "agenda": _count(env, lib.GetNextActivation),
        }


def _count(env: ClipsEnvironment, next_item: Callable[[CData, CData], CData]) -> int:
    count, item = 0, next_item(env.env, NULL)
    while item != NULL:
        count, item = count + 1, next_item(env.env, item)
    return count


@dataclass(frozen=True, slots=True)
class RuleRow:
    """A rule.

    :param agenda: the number of its activations.
    """

    name: str
    module: str
    agenda: int


def rules(env: ClipsEnvironment) -> list[RuleRow]:
    """Return all rules; the caller holds the lock, between runs of the rules."""
    activation_counts: Counter[str] = Counter()
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        activation_counts[decode(lib.ActivationRuleName(activation))] += 1
        activation = lib.GetNextActivation(env.env, activation)
    rows = []
    rule = lib.GetNextDefrule(env.env, NULL)
    while rule != NULL:
        name = decode(lib.DefruleName(rule))
        rows.append(RuleRow(name, decode(lib.DefruleModule(rule)), activation_counts[name]))
        rule = lib.GetNextDefrule(env.env, rule)
    return rows


@dataclass(frozen=True, slots=True)
class ActivationRow:
    """An activation.

    :param basis: the facts as CLIPS prints them: ``f-1,*``.
    """

    rule: str
    salience: int
    basis: str


def activations(env: ClipsEnvironment, pattern: str, window: Window) -> ListPart:
    """Return a part of the agenda as :class:`ActivationRow` items, at most :data:`MOST_ACTIVATIONS`.

    The caller holds the lock, between runs of the rules.

    :param pattern: a pattern of rule names.
    """
    limit = MOST_ACTIVATIONS if window.limit is None else min(window.limit, MOST_ACTIVATIONS)
    rows: list[ActivationRow] = []
    total = 0
    env.output.pause()
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        rule = decode(lib.ActivationRuleName(activation))
        is_match = matches(rule, pattern)
        in_window = is_match and window.offset <= total < window.offset + limit
        if is_match and (in_window or window.search):
            basis = env.api.activation_text(activation).split(":", 1)[1].strip()
            is_match = not window.search or has_text((rule, basis), window.search)
            if in_window and is_match:
                rows.append(ActivationRow(rule, int(lib.ActivationGetSalience(activation)), basis))
        total += is_match
        activation = lib.GetNextActivation(env.env, activation)
    env.output.resume()
    return ListPart(rows, total)
