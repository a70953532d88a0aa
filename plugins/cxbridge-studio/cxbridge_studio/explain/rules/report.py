"""Reports why a rule has not fired, as text and as JSON values."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge.printing import format_count
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.explain.evidence import Evidence, NoFactsError
from cxbridge_studio.explain.rules.diagnosis import CECount, Count, Diagnosis, MatchFailure
from cxbridge_studio.explain.rules.missing import SourceLine, explain_missing_rule, find_rule, format_position
from cxbridge_studio.explain.rules.sandbox import diagnose_in_sandbox
from cxbridge_studio.explain.rules.snapshot import Activation, Snapshot

MAX_REPORTED = 5  # limit of the listed complete matches and errors

_COLUMN_TITLES = ("condition", "alone", "with those before")  # of the table of conditional elements


@dataclass(frozen=True, slots=True)
class RuleStory:
    """The state of a rule, with the cause.

    :param where: the run and the time.
    :param position: the file and line of the rule; None if unknown.
    :param missing_reason: why the rule does not exist; empty if it exists. Of a rule that does not exist,
        only the name, ``where``, this reason and the notes are set.
    :param snapshot: the rule with its facts; None if the rule does not exist, or the facts are unknown.
    :param diagnosis: the diagnosis of the snapshot; None without a snapshot.
    :param activations_ahead: the activations before its first activation; None if the snapshot has no
        activation of the rule.
    :param firings: the time in seconds since the start of the run, and the facts, of each firing; None if
        unknown.
    :param notes: remarks about the source.
    :param unknown_reason: why the facts, and thus the matches, are not known; empty if they are.
    """

    rule: str
    where: str
    position: SourceLine | None = None
    missing_reason: str = ""
    snapshot: Snapshot | None = None
    diagnosis: Diagnosis | None = None
    activations_ahead: tuple[Activation, ...] | None = None
    firings: tuple[tuple[float, str], ...] | None = None
    notes: tuple[str, ...] = ()
    unknown_reason: str = ""


def explain_rule(evidence: Evidence, rule: str) -> RuleStory:
    """Explain why a rule has not fired.

    :raises CxbridgeError: if there is no such rule, or the rules or the rule's facts cannot be read.
    """
    rulebook = evidence.read_rulebook()
    if rule not in rulebook.rules:
        reason = explain_missing_rule(rule, rulebook)
        if not reason:
            raise CxbridgeError(f"there is no rule '{rule}'", hint=did_you_mean(rule, rulebook.rules) or None)
        return RuleStory(rule, evidence.where, missing_reason=reason, notes=tuple(evidence.notes))
    events = evidence.find_rule_firings(rule)
    story = RuleStory(
        rule,
        evidence.where,
        rulebook.positions.get(rule) or find_rule(rule, rulebook.files),
        firings=None
        if events is None
        else tuple((evidence.compute_seconds(event.time_us), event.basis) for event in events),
        notes=tuple(evidence.notes),
    )
    try:
        snapshot = evidence.take_snapshot(rule)
    except NoFactsError as error:
        return replace(story, unknown_reason=f"{error.message}: {error.hint}")
    agenda = snapshot.agenda or ()
    first_index = next((index for index, activation in enumerate(agenda) if activation.rule == rule), None)
    return replace(
        story,
        snapshot=snapshot,
        diagnosis=diagnose_in_sandbox(snapshot),
        activations_ahead=None if first_index is None else agenda[:first_index],
        notes=tuple(evidence.notes),  # copying the snapshot may have added notes
    )


def to_json(story: RuleStory) -> dict[str, Any]:
    """Return a story as JSON values."""
    file, line = story.position or (None, None)
    json_report: dict[str, Any] = {
        "headline": make_headline(story),
        "rule": story.rule,
        "where": story.where,
        "exists": not story.missing_reason,
        "missing": story.missing_reason,
        "file": file,
        "line": line,
        "verdict": make_verdict(story),
        "notes": list(story.notes),
        "fired": None if story.firings is None else len(story.firings),
        "last_fired": None
        if not story.firings
        else {"seconds": story.firings[-1][0], "facts": story.firings[-1][1]},
    }
    if story.diagnosis is not None and story.snapshot is not None:
        json_report |= asdict(story.diagnosis)
        json_report |= {
            "env": story.snapshot.env,
            "clips_matches": list(story.snapshot.clips_counts),
            "on_agenda": story.snapshot.activation_count,
            "ahead_on_agenda": None
            if story.activations_ahead is None
            else [asdict(activation) for activation in story.activations_ahead],
        }
    return json_report


def make_headline(story: RuleStory) -> str:
    """Return the report in one line: whether the rule has fired, and the cause."""
    if story.missing_reason:
        return f"rule {story.rule}: {story.missing_reason}"
    failure = None if story.diagnosis is None else story.diagnosis.failure
    if story.diagnosis is None or failure is None:
        return f"rule {story.rule}: {make_verdict(story)}"
    near_misses = [miss for miss in failure.near if miss.deviations]
    deviations = [deviation for miss in near_misses[:1] for deviation in miss.deviations]
    details = [
        *failure.facts[:1],
        *failure.values[:1],
        *(f"{deviation.slot} is {deviation.value}, wanted {deviation.wanted}" for deviation in deviations),
    ]
    reason = f"{failure.reason}: {'; '.join(details)}" if details else failure.reason
    if (shortage := find_shortage(story)) is not None:
        _, slot, wanted_values = shortage
        # The first word of a near miss is the index of the fact.
        values = ", ".join(f"{miss.deviations[0].value} in {miss.fact.split()[0]}" for miss in near_misses)
        reason = f"{slot} is {values}, wanted {' or '.join(wanted_values)}"
    state = (
        f"fired {format_count(len(story.firings), 'time')}, but not again"
        if story.firings
        else "has not fired"
    )
    subject = f"condition {story.diagnosis.failing} {failure.text}"
    return f"rule {story.rule} {state}: {subject} has no match: {reason}"


def find_shortage(story: RuleStory) -> tuple[str, str, list[str]] | None:
    """Return the template, the slot and the wanted values if the near misses differ in this slot alone.

    The result is None without near misses, if they differ in several slots, or if the pattern does not list
    the wanted values.
    """
    near_misses = story.diagnosis.failure.near if story.diagnosis and story.diagnosis.failure else ()
    deviations = [deviation for miss in near_misses for deviation in miss.deviations]
    slots_and_constraints = {(deviation.slot, deviation.wanted) for deviation in deviations}
    # A constraint with a variable, a test or a negation does not list the wanted values.
    if len(slots_and_constraints) != 1 or re.search("[?~:&]", deviations[0].wanted):
        return None
    # A fact is `f-1 (TEMPLATE (SLOT VALUE) ...)`.
    return (
        re.split(r"[\s()]+", near_misses[0].fact)[1],
        deviations[0].slot,
        re.split(r" or |\|", deviations[0].wanted),
    )


def make_verdict(story: RuleStory) -> str:
    """Return why the rule does not fire, as a sentence without capital and full stop."""
    diagnosis, snapshot = story.diagnosis, story.snapshot
    if story.unknown_reason:
        return f"whether its condition matches is unknown: {story.unknown_reason}"
    if diagnosis is None or snapshot is None:
        return f"there is no such rule: {story.missing_reason}"
    if diagnosis.unknown:
        return f"why it has not fired is not fully known: {diagnosis.unknown}"
    if diagnosis.failing:
        fired_text = f"fired {format_count(len(story.firings), 'time')}; now " if story.firings else ""
        return f"{fired_text}its condition does not match: condition {diagnosis.failing} has no match" + (
            " together with the conditions before" if diagnosis.failing > 1 else ""
        )
    return _explain_matches(story, diagnosis, snapshot.activation_count)


def _explain_matches(story: RuleStory, diagnosis: Diagnosis, activation_count: int | None) -> str:
    """Return why the complete matches do not make the rule fire, in the same form as :func:`make_verdict`.

    :param activation_count: the number of the rule's activations on the agenda; None if unknown.
    """
    is_single = diagnosis.matches == Count(1)
    matches_text = "its condition matches" + (" in one way" if is_single else f" in {diagnosis.matches} ways")
    if activation_count:
        # None if more activations come first than a snapshot copies.
        ahead = story.activations_ahead
        turn_text = "it is the next to fire" if ahead == () else "many other activations come first"
        if ahead:
            first_text = f"{ahead[0].rule} (salience {ahead[0].salience})"
            turn_text = f"it comes after {len(ahead)} others, first {first_text}"
        verb = "is" if activation_count == 1 else "are"
        return f"{matches_text}, {activation_count} of them {verb} on the agenda: {turn_text}"
    if activation_count is None and story.firings is None:
        return f"{matches_text}; whether it has fired for them was not recorded (level rules)"
    # A recording has no agenda: there, the firings tell which matches are still to fire.
    fired_bases = {basis for _, basis in story.firings or ()}
    unfired_bases = [basis for basis in diagnosis.bases if basis not in fired_bases]
    if unfired_bases and activation_count is None:
        return (
            f"{matches_text}, and it had not fired for {len(unfired_bases)} of them, first {unfired_bases[0]}"
        )
    return (
        f"{matches_text}, and it has fired for {'it' if is_single else 'all of them'}: "
        "it fires again when one of the facts is asserted anew"
    )


def format_report(story: RuleStory) -> Iterator[str]:
    """Yield the text of the report."""
    diagnosis, snapshot = story.diagnosis, story.snapshot
    yield make_headline(story)
    yield ""
    details = [format_position(story.position)] if story.position else []
    details += [f"salience {diagnosis.salience}"] if diagnosis is not None and diagnosis.salience else []
    yield f"rule {story.rule} ({', '.join(details)})" if details else f"rule {story.rule}"
    yield f"in {story.where}"
    yield ""
    if story.firings is not None and not story.missing_reason:
        yield _describe_firings(story.firings)
    verdict = make_verdict(story)
    yield f"{verdict[0].upper()}{verdict[1:]}."
    if diagnosis is not None and snapshot is not None:
        yield from _format_diagnosis(story, diagnosis, snapshot)


def _describe_firings(firings: tuple[tuple[float, str], ...]) -> str:
    if not firings:
        return "It has not fired."
    times = "once" if len(firings) == 1 else f"{len(firings)} times, last"
    seconds, basis = firings[-1]
    return f"It has fired {times} at {seconds:.3f} s{f' for {basis}' if basis else ''}."


def _format_diagnosis(story: RuleStory, diagnosis: Diagnosis, snapshot: Snapshot) -> Iterator[str]:
    if diagnosis.elements:
        yield ""
        yield from _format_table(diagnosis.elements, diagnosis.failing)
    if diagnosis.unknown and snapshot.clips_counts:
        # CLIPS' numbers are hard to read, but better than none.
        yield ""
        yield "CLIPS' own (matches), where patterns are counted through all groups:"
        yield from (f"  {line}" for line in snapshot.clips_counts)
    if diagnosis.failure is not None:
        yield ""
        yield from _format_failure(diagnosis.failure, f"condition {diagnosis.failing}: ", "  ")
    elif diagnosis.bases:
        yield ""
        yield "it matches for"
        fired_at = {basis: seconds for seconds, basis in story.firings or ()}
        for basis in diagnosis.bases[:MAX_REPORTED]:
            yield f"  {basis}{f'  fired at {fired_at[basis]:.3f} s' if basis in fired_at else ''}"
        if len(diagnosis.bases) > MAX_REPORTED:
            yield "  and more"
    for error in diagnosis.errors[:MAX_REPORTED]:
        yield f"CLIPS, while evaluating the condition: {error}"


def _format_table(elements: tuple[CECount, ...], failing: int) -> Iterator[str]:
    rows = [
        (str(element.number), str(element.alone or ""), str(element.joined or ""), element.text)
        for element in elements
    ]
    widths = [
        max(len(title), *(len(row[column]) for row in rows)) for column, title in enumerate(_COLUMN_TITLES)
    ]
    yield "  " + "  ".join(title.rjust(width) for title, width in zip(_COLUMN_TITLES, widths, strict=True))
    for (*counts, text), element in zip(rows, elements, strict=True):
        cells = (cell.rjust(width) for cell, width in zip(counts, widths, strict=True))
        yield "  ".join([f"{'>' if element.number == failing else ' '} {next(cells)}", *cells, text])


def _format_failure(failure: MatchFailure, title: str, indent: str) -> Iterator[str]:
    yield f"{title}{failure.reason}"
    for miss in failure.near:
        yield f"{indent}{miss.fact}"
        for deviation in miss.deviations:
            bindings = " where " + ", ".join(deviation.known) if deviation.known else ""
            yield f"{indent}  {deviation.slot} is {deviation.value}, wanted {deviation.wanted}{bindings}"
    for text in (*failure.facts, *failure.values):
        yield f"{indent}{text}"
    for inner_failure in failure.inner:
        yield from _format_failure(inner_failure, f"{indent}{inner_failure.text}: ", indent + "  ")
