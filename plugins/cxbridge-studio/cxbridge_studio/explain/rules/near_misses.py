"""Finds the facts that nearly match a pattern, with the slots that differ."""

from __future__ import annotations

import re
from collections import Counter
from typing import Final

from cxbridge.clipstext.condition import PatternCE, SlotConstraint
from cxbridge.clipstext.values import FactRef, Value, show_alone
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.rule import Prefix
from cxbridge_studio.explain.rules.diagnosis import Deviation, MatchFailure, NearMiss
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.snapshot import Snapshot

MOST_PAIRS: Final = 20_000  # limit of compared pairs of a partial match and a fact

MOST_NEAR: Final = 3  # limit of listed facts

_BINDER = re.compile(r"^\?[^\s&|~:]+&(?!:)")  # a variable that takes any value: not a constraint

_FACT = "cx-why-fact"

_Key = tuple[FactRef, ...]


def find_nearest(matcher: Matcher, snapshot: Snapshot, prefix: Prefix, pattern: PatternCE) -> MatchFailure:
    """Return the facts that match the most slots of a pattern without a match.

    :raises ClipsError: if the pattern cannot be matched.
    """
    rows = [row for row in snapshot.facts if row.template == pattern.template]
    if not rows:
        return MatchFailure("pattern", pattern.text, f"there is no fact of '{pattern.template}'")
    parts = pattern.tested(prefix.binds)
    bound = sorted(prefix.binds)
    sample = _Sample(matcher, prefix, max(1, MOST_PAIRS // len(rows)), bound)
    satisfied: dict[tuple[_Key, int], set[int]] = {
        (key, row.index): set() for key in sample.values for row in rows
    }
    compared = [
        part_index
        for part_index, part in enumerate(parts)
        if _compare(matcher, sample, pattern, part, part_index, satisfied)
    ]
    ranked = _ranked(satisfied)
    best = len(satisfied[ranked[0]]) if ranked else 0
    chosen: dict[int, tuple[_Key, int]] = {}
    for pair in ranked:
        if len(satisfied[pair]) == best and len(chosen) < MOST_NEAR:
            chosen.setdefault(pair[1], pair)
    near = []
    for index, pair in chosen.items():
        row = matcher.rows[index]
        missing = [parts[part_index] for part_index in compared if part_index not in satisfied[pair]]
        deviations = tuple(
            Deviation(
                part.label,
                snapshot.value_text(row, part.slot, part.position),
                _BINDER.sub("", part.text),
                tuple(_known(part, prefix, sample.values[pair[0]])),
            )
            for part in missing
        )
        near.append(NearMiss(snapshot.fact_text(row, {part.slot for part in parts}), deviations))
    return MatchFailure(
        "pattern", pattern.text, _reason(prefix, sample, best, len(compared), near), tuple(near)
    )


def _ranked(satisfied: dict[tuple[_Key, int], set[int]]) -> list[tuple[_Key, int]]:
    """Return the pairs with the most satisfied slots first; slots that few facts satisfy break ties."""
    counts = Counter(slot_index for slot_indices in satisfied.values() for slot_index in slot_indices)

    def rank(pair: tuple[_Key, int]) -> tuple[int, float, int]:
        slot_indices = satisfied[pair]
        return len(slot_indices), sum(1 / counts[slot_index] for slot_index in slot_indices), pair[1]

    return sorted(satisfied, key=rank, reverse=True)


def _reason(prefix: Prefix, sample: _Sample, best: int, parts: int, near: list[NearMiss]) -> str:
    if not any(miss.deviations for miss in near):
        return "each part of it matches some fact, but not all parts together match one"
    verb = "goes with the facts before it" if prefix.facts else "matches"
    more = ", in a sample of the matches" if sample.cut else ""
    slots = "slot" if parts == 1 else "slots"
    return f"no fact {verb}; the nearest have {best} of {parts} {slots} right{more}"


def _compare(
    matcher: Matcher,
    sample: _Sample,
    pattern: PatternCE,
    part: SlotConstraint,
    index: int,
    satisfied: dict[tuple[_Key, int], set[int]],
) -> bool:
    """Record which pairs satisfy one slot, and return whether the slot can be compared."""
    ces = [*sample.texts, f"?{_FACT} <- {pattern.only(part, sample.prefix.binds)}"]
    try:
        matches = matcher.note(ces, [*sample.prefix.facts, _FACT], limit=10 * MOST_PAIRS)
    except ClipsError:
        return False
    for *key, fact in matches:
        pair = (tuple(key), fact.index)
        if pair in satisfied:
            satisfied[pair].add(index)
    return True


def _known(part: SlotConstraint, prefix: Prefix, values: dict[str, Value]) -> list[str]:
    """Return the values of the variables in a slot that other CEs bind."""
    return [
        f"?{name} = {show_alone(values[name])} (CE {prefix.origin(name)})"
        for name in sorted(part.used | part.binds)
        if name in values
    ]


class _Sample:
    """The partial matches, or a sample if there are many.

    :ivar values: values of all variables, by the facts of the match.
    :ivar texts: conditional elements that match only these.
    """

    def __init__(self, matcher: Matcher, prefix: Prefix, limit: int, bound: list[str]) -> None:
        self.prefix = prefix
        self.values: dict[_Key, dict[str, Value]] = {}
        self.texts = list(prefix.texts)
        self.cut = False
        width = len(prefix.facts)
        if not prefix.texts:
            self.values[()] = {}
        else:
            rows = matcher.note(prefix.texts, [*prefix.facts, *bound], limit + 1)
            for row in rows[:limit]:
                self.values.setdefault(tuple(row[:width]), dict(zip(bound, row[width:], strict=True)))
            self.cut = len(rows) > limit
        if self.cut and width:
            fact_keys = " ".join(f'"{",".join(str(ref.index) for ref in key)}"' for key in self.values)
            index = ' "," '.join(f"(fact-index ?{name})" for name in prefix.facts)
            self.texts.append(f"(test (member$ (str-cat {index}) (create$ {fact_keys})))")
