"""Finds the facts that nearly match a pattern, with the slots that differ.

A partial match is a match of the conditional elements (CEs) before the pattern. For each constrained slot
alone, CLIPS matches the partial matches with all facts of the pattern's template. The pairs of a partial
match and a fact that satisfy the most slots are the near misses.
"""

from __future__ import annotations

import re
from collections import Counter
from typing import Final

from cxbridge.clipstext.values import FactRef, Value, lone_value_text
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.condition import PatternCE, SlotConstraint
from cxbridge_studio.agent.rule import Prefix
from cxbridge_studio.explain.rules.diagnosis import Deviation, MatchFailure, NearMiss
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.snapshot import Snapshot

MAX_PAIRS: Final = 20_000  # limit of the compared pairs of a partial match and a fact

MAX_NEAR: Final = 3  # limit of the listed facts

# A variable before the constraint, as in `?x&red`: it takes any value, so the report omits it.
_LEADING_VARIABLE = re.compile(r"^\?[^\s&|~:]+&(?!:)")

FACT_VARIABLE: Final = "cx-why-fact"
"""The variable of the fact that a pattern in question matches."""

_MatchKey = tuple[FactRef, ...]  # the facts of a partial match
_Pair = tuple[_MatchKey, int]  # a partial match, and the index of a fact


def find_nearest(matcher: Matcher, snapshot: Snapshot, prefix: Prefix, pattern: PatternCE) -> MatchFailure:
    """Explain a pattern without a match by the facts that match the most slots.

    :raises ClipsError: if the pattern cannot be matched.
    """
    rows = [row for row in snapshot.facts if row.template == pattern.template]
    if not rows:
        return MatchFailure("pattern", pattern.text, f"there is no fact of '{pattern.template}'")
    constraints = pattern.find_restrictive_constraints(prefix.bound_variables)
    sample = _Sample(matcher, prefix, max(1, MAX_PAIRS // len(rows)))
    # The indices of the constraints that each pair satisfies.
    satisfied_indices: dict[_Pair, set[int]] = {
        (key, row.index): set() for key in sample.values for row in rows
    }
    compared_indices = [
        constraint_index
        for constraint_index, constraint in enumerate(constraints)
        if _compare_slot(matcher, sample, pattern, constraint, constraint_index, satisfied_indices)
    ]
    ranked_pairs = _rank_pairs(satisfied_indices)
    best_slot_count = len(satisfied_indices[ranked_pairs[0]]) if ranked_pairs else 0
    chosen_keys: dict[int, _MatchKey] = {}
    for key, index in ranked_pairs:
        if len(satisfied_indices[key, index]) == best_slot_count and len(chosen_keys) < MAX_NEAR:
            chosen_keys.setdefault(index, key)  # a fact is listed once, with its best partial match
    near_misses = []
    for index, key in chosen_keys.items():
        row = matcher.rows[index]
        # The fact is equally near to these partial matches, which may want different values.
        equally_near_matches = [
            values
            for other_key, values in sample.values.items()
            if satisfied_indices[other_key, index] == satisfied_indices[key, index]
        ]
        deviations = tuple(
            Deviation(
                constraint.label,
                snapshot.value_text(row, constraint.slot, constraint.position),
                *_describe_wanted(constraint, prefix, [sample.values[key], *equally_near_matches]),
            )
            for constraint_index, constraint in enumerate(constraints)
            if constraint_index in compared_indices and constraint_index not in satisfied_indices[key, index]
        )
        near_misses.append(
            NearMiss(snapshot.fact_text(row, {constraint.slot for constraint in constraints}), deviations)
        )
    return MatchFailure(
        "pattern",
        pattern.text,
        _describe_failure(prefix, sample, best_slot_count, len(compared_indices), near_misses),
        tuple(near_misses),
    )


def _rank_pairs(satisfied_indices: dict[_Pair, set[int]]) -> list[_Pair]:
    """Return the pairs with the most satisfied slots first.

    Of pairs with the same number of slots, the pair whose slots fewer pairs satisfy comes first, then the
    pair with the later fact.
    """
    pair_counts = Counter(index for indices in satisfied_indices.values() for index in indices)

    def rank(pair: _Pair) -> tuple[int, float, int]:
        indices, (_, fact_index) = satisfied_indices[pair], pair
        return len(indices), sum(1 / pair_counts[index] for index in indices), fact_index

    return sorted(satisfied_indices, key=rank, reverse=True)


def _describe_failure(
    prefix: Prefix, sample: _Sample, best_slot_count: int, compared_count: int, near_misses: list[NearMiss]
) -> str:
    if not any(miss.deviations for miss in near_misses):
        return "each of its slots matches some fact, but no fact matches all of its slots"
    verb = "matches together with the conditions before" if prefix.fact_variables else "matches"
    limitation = ", in a sample of the matches" if sample.is_limited else ""
    nearest = f"; the nearest agree in {best_slot_count} of {compared_count} slots" if best_slot_count else ""
    return f"no fact {verb}{nearest}{limitation}"


def _compare_slot(
    matcher: Matcher,
    sample: _Sample,
    pattern: PatternCE,
    constraint: SlotConstraint,
    constraint_index: int,
    satisfied_indices: dict[_Pair, set[int]],
) -> bool:
    """Record which pairs satisfy one slot, and return whether the slot can be compared.

    :param constraint_index: the index of the slot's constraint.
    :param satisfied_indices: receives this index for each pair that satisfies the slot.
    """
    text = pattern.restricted_text(constraint, sample.prefix.bound_variables)
    try:
        matches = matcher.match_values(
            [*sample.texts, f"?{FACT_VARIABLE} <- {text}"],
            [*sample.prefix.fact_variables, FACT_VARIABLE],
            # A multislot may match in several ways for one pair, hence more matches than pairs.
            limit=10 * MAX_PAIRS,
        )
    except ClipsError:  # the slot calls a function that only the run has
        return False
    for *key, fact in matches:
        pair = (tuple(key), fact.index)
        if pair in satisfied_indices:
            satisfied_indices[pair].add(constraint_index)
    return True


def _describe_wanted(
    constraint: SlotConstraint, prefix: Prefix, matches: list[dict[str, Value]]
) -> tuple[str, tuple[str, ...]]:
    """Return the wanted values of a slot as text, and the variables in that text with their values.

    The text is the slot's constraint; for a constraint that is a single variable, the values of the variable.

    :param matches: the values of the variables in the nearest partial matches.
    """
    text = _LEADING_VARIABLE.sub("", constraint.text)
    variable, nearest_values = text.removeprefix("?"), matches[0]
    if variable != text and variable in nearest_values:
        values = sorted({lone_value_text(match[variable]) for match in matches})
        return " or ".join([*values[:MAX_NEAR], *(["another"] if len(values) > MAX_NEAR else [])]), ()
    return text, tuple(
        f"?{name} = {lone_value_text(nearest_values[name])} (condition {prefix.binding_ce_numbers[name]})"
        for name in sorted(constraint.used_variables | constraint.bound_variables)
        if name in nearest_values
    )


class _Sample:
    """The partial matches up to a limit.

    :ivar values: the values of all variables by name, by the facts of the partial match.
    :ivar texts: CEs that have only these partial matches.
    :ivar is_limited: whether there are more partial matches than the limit.
    """

    def __init__(self, matcher: Matcher, prefix: Prefix, limit: int) -> None:
        self.prefix = prefix
        self.values: dict[_MatchKey, dict[str, Value]] = {}
        self.texts = list(prefix.texts)
        names, width = sorted(prefix.bound_variables), len(prefix.fact_variables)
        # Without CEs before the pattern, there is one empty partial match.
        rows = (
            matcher.match_values(prefix.texts, [*prefix.fact_variables, *names], limit + 1)
            if prefix.texts
            else [()]
        )
        for row in rows[:limit]:
            self.values.setdefault(tuple(row[:width]), dict(zip(names, row[width:], strict=True)))
        self.is_limited = len(rows) > limit
        if self.is_limited and width:
            # This test keeps CLIPS from matching the facts with the other partial matches.
            fact_keys = " ".join(f'"{",".join(str(ref.index) for ref in key)}"' for key in self.values)
            indices = ' "," '.join(f"(fact-index ?{name})" for name in prefix.fact_variables)
            self.texts.append(f"(test (member$ (str-cat {indices}) (create$ {fact_keys})))")
