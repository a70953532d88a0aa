"""Finds the facts that nearly match a pattern, with the slots that differ.

For each constrained slot alone, CLIPS matches the partial matches before the pattern with all its facts. The
pairs of a partial match and a fact that satisfy the most slots are the near misses.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Final

from cxbridge.clipstext.values import FactRef, Value, show_alone
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.condition import PatternCE, SlotConstraint
from cxbridge_studio.agent.rule import Prefix
from cxbridge_studio.explain.rules.diagnosis import Deviation, MatchFailure, NearMiss
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.snapshot import Snapshot

MAX_PAIRS: Final = 20_000  # limit of the compared pairs of a partial match and a fact

MAX_NEAR: Final = 3  # limit of the listed facts

_BINDER = re.compile(r"^\?[^\s&|~:]+&(?!:)")  # a variable that takes any value: not a constraint

_FACT = "cx-why-fact"

_Key = tuple[FactRef, ...]  # the facts of a partial match


def find_nearest(matcher: Matcher, snapshot: Snapshot, prefix: Prefix, pattern: PatternCE) -> MatchFailure:
    """Return the facts that match the most slots of a pattern without a match.

    :raises ClipsError: if the pattern cannot be matched.
    """
    rows = [row for row in snapshot.facts if row.template == pattern.template]
    if not rows:
        return MatchFailure("pattern", pattern.text, f"there is no fact of '{pattern.template}'")
    constraints = pattern.restrictive_parts(prefix.binds)
    sample = _Sample(matcher, prefix, max(1, MAX_PAIRS // len(rows)))
    satisfied: dict[tuple[_Key, int], set[int]] = {
        (key, row.index): set() for key in sample.values for row in rows
    }
    compared = [
        number
        for number, constraint in enumerate(constraints)
        if _compare(matcher, sample, pattern, constraint, number, satisfied)
    ]
    ranked = _ranked(satisfied)
    best_count = len(satisfied[ranked[0]]) if ranked else 0
    chosen: dict[int, _Key] = {}
    for key, index in ranked:
        if len(satisfied[key, index]) == best_count and len(chosen) < MAX_NEAR:
            chosen.setdefault(index, key)  # a fact is listed once, with its best partial match
    near_misses = []
    for index, key in chosen.items():
        row = matcher.rows[index]
        deviations = tuple(
            Deviation(
                constraint.label,
                snapshot.value_text(row, constraint.slot, constraint.position),
                _BINDER.sub("", constraint.text),
                tuple(_bound_values(constraint, prefix, sample.values[key])),
            )
            for number, constraint in enumerate(constraints)
            if number in compared and number not in satisfied[key, index]
        )
        near_misses.append(
            NearMiss(snapshot.fact_text(row, {constraint.slot for constraint in constraints}), deviations)
        )
    return MatchFailure(
        "pattern",
        pattern.text,
        _reason(prefix, sample, best_count, len(compared), near_misses),
        tuple(near_misses),
    )


def _ranked(satisfied: dict[tuple[_Key, int], set[int]]) -> list[tuple[_Key, int]]:
    """Return the pairs with the most satisfied slots first.

    Of pairs with as many slots, the pair whose slots fewer facts satisfy comes first, then the later fact.
    """
    counts = Counter(slot_index for slot_indices in satisfied.values() for slot_index in slot_indices)

    def rank(pair: tuple[_Key, int]) -> tuple[int, float, int]:
        _, fact_index = pair
        slot_indices = satisfied[pair]
        return len(slot_indices), sum(1 / counts[slot_index] for slot_index in slot_indices), fact_index

    return sorted(satisfied, key=rank, reverse=True)


def _reason(
    prefix: Prefix, sample: _Sample, best_count: int, compared: int, near_misses: list[NearMiss]
) -> str:
    if not any(miss.deviations for miss in near_misses):
        return "each part of it matches some fact, but not all parts together match one"
    verb = "goes with the facts before it" if prefix.facts else "matches"
    limitation = ", in a sample of the matches" if sample.is_limited else ""
    slots = "slot" if compared == 1 else "slots"
    return f"no fact {verb}; the nearest have {best_count} of {compared} {slots} right{limitation}"


def _compare(
    matcher: Matcher,
    sample: _Sample,
    pattern: PatternCE,
    constraint: SlotConstraint,
    number: int,
    satisfied: dict[tuple[_Key, int], set[int]],
) -> bool:
    """Record which pairs satisfy one slot, and return whether the slot can be compared.

    :param number: the number of the constraint, which ``satisfied`` gets.
    """
    ces = [*sample.texts, f"?{_FACT} <- {pattern.only(constraint, sample.prefix.binds)}"]
    try:
        # A multislot matches in several ways for one pair, hence more matches than pairs.
        matches = matcher.match_values(ces, [*sample.prefix.facts, _FACT], limit=10 * MAX_PAIRS)
    except ClipsError:  # the slot calls a function that only the run has
        return False
    for *key, fact in matches:
        pair = (tuple(key), fact.index)
        if pair in satisfied:
            satisfied[pair].add(number)
    return True


def _bound_values(constraint: SlotConstraint, prefix: Prefix, values: dict[str, Value]) -> list[str]:
    """Return the values of the variables in a slot that other CEs bind."""
    return [
        f"?{name} = {show_alone(values[name])} (CE {prefix.origin(name)})"
        for name in sorted(constraint.used | constraint.binds)
        if name in values
    ]


class _Sample:
    """The partial matches, or a sample if there are many.

    :ivar values: the values of all variables, by the facts of the match.
    :ivar texts: the conditional elements that match only these partial matches.
    :ivar is_limited: whether there are more partial matches than the limit.
    """

    def __init__(self, matcher: Matcher, prefix: Prefix, limit: int) -> None:
        self.prefix = prefix
        self.values: dict[_Key, dict[str, Value]] = {}
        self.texts = list(prefix.texts)
        names, width = sorted(prefix.binds), len(prefix.facts)
        rows = (
            matcher.match_values(prefix.texts, [*prefix.facts, *names], limit + 1) if prefix.texts else [()]
        )
        for row in rows[:limit]:
            self.values.setdefault(tuple(row[:width]), dict(zip(names, row[width:], strict=True)))
        self.is_limited = len(rows) > limit
        if self.is_limited and width:
            # Without this test, CLIPS would match the facts with all partial matches again.
            fact_keys = " ".join(f'"{",".join(str(ref.index) for ref in key)}"' for key in self.values)
            index = ' "," '.join(f"(fact-index ?{name})" for name in prefix.facts)
            self.texts.append(f"(test (member$ (str-cat {index}) (create$ {fact_keys})))")
