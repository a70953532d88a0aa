"""The views of a CLIPS environment."""

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

MOST_ACTIVATIONS: Final = 1000
"""Activations of an agenda that are reported at once."""


def census(env: ClipsEnvironment) -> dict[str, int]:
    """Return how many facts, rules and activations there are."""
    with env.lock:
        return {
            "facts": _count(env, lib.GetNextFact),
            "rules": _count(env, lib.GetNextDefrule),
            "agenda": _count(env, lib.GetNextActivation),
        }


def _count(env: ClipsEnvironment, following: Callable[[CData, CData], CData]) -> int:
    count, item = 0, following(env.env, NULL)
    while item != NULL:
        count, item = count + 1, following(env.env, item)
    return count


@dataclass(frozen=True, slots=True)
class RuleRow:
    """A rule.

    :param agenda: how often it is on the agenda.
    """

    name: str
    module: str
    agenda: int


def rules(env: ClipsEnvironment) -> list[RuleRow]:
    """Return all rules. To be called between runs of the rules, with the lock held."""
    waiting: Counter[str] = Counter()
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        waiting[decode(lib.ActivationRuleName(activation))] += 1
        activation = lib.GetNextActivation(env.env, activation)
    rows = []
    rule = lib.GetNextDefrule(env.env, NULL)
    while rule != NULL:
        name = decode(lib.DefruleName(rule))
        rows.append(RuleRow(name, decode(lib.DefruleModule(rule)), waiting[name]))
        rule = lib.GetNextDefrule(env.env, rule)
    return rows


@dataclass(frozen=True, slots=True)
class ActivationRow:
    """An activation.

    :param basis: the facts, as CLIPS prints them: ``f-1,*``.
    """

    rule: str
    salience: int
    basis: str


def activations(env: ClipsEnvironment, pattern: str, window: Window) -> ListPart:
    """Return a part of the agenda, :data:`MOST_ACTIVATIONS` at most; its items are :class:`ActivationRow`.

    To be called between runs of the rules, with the lock held.

    :param pattern: of the rules' names.
    """
    most = MOST_ACTIVATIONS if window.limit is None else min(window.limit, MOST_ACTIVATIONS)
    rows: list[ActivationRow] = []
    total = 0
    env.output.pause()
    activation = lib.GetNextActivation(env.env, NULL)
    while activation != NULL:
        rule = decode(lib.ActivationRuleName(activation))
        wanted = matches(rule, pattern)
        seen = wanted and window.offset <= total < window.offset + most
        if wanted and (seen or window.search):
            basis = env.api.activation_text(activation).split(":", 1)[1].strip()
            wanted = not window.search or has_text((rule, basis), window.search)
            if seen and wanted:
                rows.append(ActivationRow(rule, int(lib.ActivationGetSalience(activation)), basis))
        total += wanted
        activation = lib.GetNextActivation(env.env, activation)
    env.output.resume()
    return ListPart(rows, total)
