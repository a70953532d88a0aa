"""Diagnoses a rule's condition, one conditional element (CE) after the other, with CLIPS' own matcher.

The CEs are matched as growing prefixes: the first prefix without a match ends with the CE to explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Final

from cxbridge.clipstext.values import lone_value_text
from cxbridge.errors import ClipsError
from cxbridge_studio.agent.condition import CE, GroupCE, PatternCE, TestCE
from cxbridge_studio.agent.rule import Condition, Prefix, parse_rule
from cxbridge_studio.explain.rules.diagnosis import CECount, Count, Diagnosis, MatchFailure
from cxbridge_studio.explain.rules.matcher import Matcher
from cxbridge_studio.explain.rules.near_misses import FACT_VARIABLE, find_nearest
from cxbridge_studio.explain.rules.snapshot import Snapshot

MAX_LISTED: Final = 3  # limit of the listed facts, values and near misses

MAX_BASES: Final = 200  # limit of the complete matches that a report compares with the firings

# A pattern may match one fact in several ways, so more matches are read than facts are shown.
_MAX_NOT_MATCHES: Final = 20 * MAX_LISTED

_UNLIMITED: Final = -1  # the limit with which CLIPS fires all activations


def diagnose(snapshot: Snapshot) -> Diagnosis:
    """Match the condition of the snapshot's rule, and explain a mismatch."""
    if snapshot.uncopied_count:
        # The count ends at the first fact beyond the limit.
        return make_unknown_diagnosis(
            snapshot, f"{snapshot.uncopied_count - 1}+ facts of its templates are too many to match"
        )
    try:
        with Matcher(snapshot) as matcher:
            return _Diagnoser(snapshot, parse_rule(snapshot.text), matcher).make_diagnosis()
    except ClipsError as error:
        return make_unknown_diagnosis(snapshot, error.message)


def make_unknown_diagnosis(snapshot: Snapshot, reason: str) -> Diagnosis:
    """Return the diagnosis of a condition that cannot be matched."""
    condition = parse_rule(snapshot.text)
    elements = tuple(CECount(number, ce.text, None, None) for number, ce in enumerate(condition.ces, 1))
    return Diagnosis(condition.salience, elements, unknown=reason)


class _Diagnoser:
    """Diagnoses one rule.

    :param condition: the parsed condition of the snapshot's rule.
    """

    def __init__(self, snapshot: Snapshot, condition: Condition, matcher: Matcher) -> None:
        self._snapshot = snapshot
        self._condition = condition
        self._matcher = matcher

    def make_diagnosis(self) -> Diagnosis:
        """Count the matches, and explain the first CE without a match."""
        ces, matcher = self._condition.ces, self._matcher
        elements: list[CECount] = []
        failing_number = 0  # from 1; 0 while all CEs match
        unknown_reason = ""
        joined_count: Count | None = matcher.count(())  # the count of a rule without a condition
        for number, ce in enumerate(ces, 1):
            if failing_number or unknown_reason:
                joined_count = None
            else:
                try:
                    joined_count = matcher.count([prefix_ce.text for prefix_ce in ces[:number]])
                    failing_number = number if joined_count.number == 0 else 0
                except ClipsError as error:
                    joined_count = None
                    unknown_reason = f"condition {number} cannot be matched on a copy: {error.message}"
            elements.append(CECount(number, ce.text, self._count_alone(ces[: number - 1], ce), joined_count))
        is_matched = not failing_number and not unknown_reason
        return Diagnosis(
            self._condition.salience,
            tuple(elements),
            failing_number,
            self._explain_element(list(ces[: failing_number - 1]), ces[failing_number - 1])
            if failing_number
            else None,
            joined_count if is_matched else None,
            tuple(matcher.match_bases([ce.text for ce in ces], MAX_BASES)) if is_matched else (),
            tuple(matcher.errors),
            unknown_reason,
        )

    def _count_alone(self, previous_ces: Sequence[CE], ce: CE) -> Count | None:
        """Return the number of facts that match a CE's single pattern alone, without the CEs before it.

        The result is None if the CE is not a pattern, has variables of the CEs before it, or cannot be
        matched.
        """
        pattern = ce.items[0] if isinstance(ce, GroupCE) and len(ce.items) == 1 else ce
        if not isinstance(pattern, PatternCE):
            return None
        variables = pattern.bound_variables.union(
            *(constraint.used_variables for constraint in pattern.constraints)
        )
        if variables & Prefix(previous_ces).bound_variables:
            return None
        try:
            matches = self._matcher.match_values(
                [f"?{FACT_VARIABLE} <- {pattern.text_without_variable()}"], [FACT_VARIABLE], limit=_UNLIMITED
            )
        except ClipsError:
            return None
        return Count(len(set(matches)))  # a multislot can match in several ways, but the fact counts once

    def _explain_element(self, previous_ces: list[CE], ce: CE) -> MatchFailure:
        """Explain why a CE has no match although all CEs before it match."""
        try:
            if isinstance(ce, PatternCE):
                return find_nearest(self._matcher, self._snapshot, Prefix(previous_ces), ce)
            if isinstance(ce, TestCE):
                return self._explain_test(Prefix(previous_ces), ce)
            return self._explain_group(previous_ces, ce)
        except ClipsError as error:
            return MatchFailure("unknown", ce.text, f"why it has no match is unknown: {error.message}")

    def _explain_group(self, previous_ces: list[CE], ce: GroupCE) -> MatchFailure:
        match ce.kind:
            case "not":
                return self._explain_not(previous_ces, ce)
            case "forall":
                return self._explain_forall(previous_ces, ce)
            case "or":
                branches = tuple(self._explain_element(previous_ces, branch) for branch in ce.items)
                return MatchFailure("or", ce.text, "none of its branches matches", inner=branches)
        failure = self._explain_sequence(previous_ces, list(ce.items))
        # For an `and`, the failure of the first CE without a match counts, with the kind of that CE.
        return replace(failure, kind="exists", text=ce.text) if ce.kind == "exists" else failure

    def _explain_test(self, prefix: Prefix, ce: TestCE) -> MatchFailure:
        names = sorted(ce.used_variables & prefix.bound_variables)
        values = dict.fromkeys(
            ", ".join(f"?{name} = {lone_value_text(value)}" for name, value in zip(names, row, strict=True))
            for row in (self._matcher.match_values(prefix.texts, names, MAX_LISTED) if names else ())
        )
        return MatchFailure("test", ce.text, "it is false for every match so far", values=tuple(values))

    def _explain_not(self, previous_ces: list[CE], ce: GroupCE) -> MatchFailure:
        positive_prefix = Prefix([*previous_ces, *ce.items])
        negated_variables = positive_prefix.fact_variables[len(Prefix(previous_ces).fact_variables) :]
        rows = (
            self._matcher.match_values(positive_prefix.texts, negated_variables, _MAX_NOT_MATCHES)
            if negated_variables
            else []
        )
        negated_patterns = [inner_ce for inner_ce in ce.items if isinstance(inner_ce, PatternCE)]
        facts = dict.fromkeys(
            " with ".join(
                self._format_fact(ref.index, pattern)
                for ref, pattern in zip(row, negated_patterns, strict=True)
            )
            for row in rows
        )
        reason = "its content matches" if facts else "its content always matches"
        more = ("and more",) if len(facts) > MAX_LISTED else ()
        return MatchFailure("not", ce.text, reason, facts=(*list(facts)[:MAX_LISTED], *more))

    def _explain_forall(self, previous_ces: list[CE], ce: GroupCE) -> MatchFailure:
        premise, *requirements = ce.items
        requirement_text = " ".join(requirement.text for requirement in requirements)
        facts: list[str] = []
        if isinstance(premise, PatternCE):
            positive_prefix = Prefix([*previous_ces, premise])
            # CLIPS replaces (forall A B) by (not (and A (not B))): facts of A without B violate the forall.
            violating_texts = [*positive_prefix.texts, f"(not (and {requirement_text}))"]
            rows = self._matcher.match_values(
                violating_texts, positive_prefix.fact_variables[-1:], MAX_LISTED
            )
            facts = [self._format_fact(ref.index, premise) for (ref,) in rows]
        reason = f"not every {premise.text} has {requirement_text}"
        return MatchFailure("forall", ce.text, reason, facts=tuple(dict.fromkeys(facts)))

    def _explain_sequence(self, previous_ces: list[CE], ces: list[CE]) -> MatchFailure:
        """Explain the first of several CEs that has no match together with the CEs before it.

        :raises ClipsError: if there is no such CE.
        """
        for index, ce in enumerate(ces):
            prefix = Prefix([*previous_ces, *ces[: index + 1]])
            if self._matcher.count(prefix.texts).number == 0:
                return self._explain_element([*previous_ces, *ces[:index]], ce)
        raise ClipsError("its parts match one after another, but it does not match as a whole")

    def _format_fact(self, index: int, pattern: PatternCE) -> str:
        return self._snapshot.fact_text(
            self._matcher.rows[index], {constraint.slot for constraint in pattern.constraints}
        )
