"""Explanation why a rule has not fired, as text and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from typing import Any

from cxbridge.errors import CxbridgeError
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.explain.evidence import Evidence, NoFactsError
from cxbridge_studio.explain.rules.diagnosis import CECount, Count, Diagnosis, MatchFailure
from cxbridge_studio.explain.rules.locations import SourceLine, find_rule, why_missing
from cxbridge_studio.explain.rules.sandbox import diagnose_in_sandbox
from cxbridge_studio.explain.rules.snapshot import Snapshot, Waiting

MOST_BASES = 5  # limit of listed complete matches


@dataclass(frozen=True, slots=True)
class RuleExplanation:
    """The report about a rule.

    :param where: the run and the time.
    :param place: the position of the rule.
    :param missing: why the rule does not exist; other fields are empty then.
    :param waiting: the number of its activations on the agenda; None if unknown.
    :param ahead: the activations before its first; None without an activation.
    :param fired: time in seconds and facts of each firing; None if unknown.
    :param notes: remarks about the source.
    :param unknown: why a match of the condition is not known; empty if it is known.
    """

    rule: str
    where: str
    place: SourceLine | None = None
    missing: str = ""
    snapshot: Snapshot | None = None
    diagnosis: Diagnosis | None = None
    waiting: int | None = None
    ahead: tuple[Waiting, ...] | None = None
    fired: tuple[tuple[float, str], ...] | None = None
    notes: tuple[str, ...] = ()
    unknown: str = ""


def explain_rule(evidence: Evidence, rule: str) -> RuleExplanation:
    """Explain why a rule has not fired.

    :raises CxbridgeError: if the rule is unknown, or its facts are.
    """
    book = evidence.rulebook()
    if rule not in book.rules:
        missing = why_missing(rule, book)
        if not missing:
            raise unknown("rule", rule, book.rules)
        return RuleExplanation(rule, evidence.where, missing=missing, notes=tuple(evidence.notes))
    firings = evidence.firings(rule)
    known = RuleExplanation(
        rule,
        evidence.where,
        SourceLine(*book.places[rule]) if rule in book.places else find_rule(rule, book.files),
        fired=None if firings is None else tuple((evidence.seconds(e.time_us), e.basis) for e in firings),
        notes=tuple(evidence.notes),
    )
    try:
        snapshot = evidence.snapshot(rule)
    except NoFactsError as error:
        return replace(known, unknown=f"{error.message}: {error.hint}")
    own_activations, ahead = _on_agenda(rule, snapshot)
    return replace(
        known,
        snapshot=snapshot,
        diagnosis=diagnose_in_sandbox(snapshot),
        waiting=own_activations,
        ahead=ahead,
        notes=tuple(evidence.notes),
    )


def unknown(kind: str, name: str, known: Iterable[str]) -> CxbridgeError:
    return CxbridgeError(f"there is no {kind} '{name}'", hint=did_you_mean(name, known) or None)


def _on_agenda(rule: str, snapshot: Snapshot) -> tuple[int | None, tuple[Waiting, ...] | None]:
    """Return the number of activations of a rule, and the activations before its first."""
    if snapshot.agenda is None:
        return None, None
    first_index = next((index for index, waiting in enumerate(snapshot.agenda) if waiting.rule == rule), None)
    return snapshot.activations, None if first_index is None else snapshot.agenda[:first_index]


def plain(story: RuleExplanation) -> dict[str, Any]:
    result: dict[str, Any] = {
        "headline": headline(story),
        "rule": story.rule,
        "where": story.where,
        "exists": not story.missing,
        "missing": story.missing,
        "file": story.place.file if story.place else None,
        "line": story.place.line if story.place else None,
        "verdict": verdict(story),
        "notes": list(story.notes),
        "fired": None if story.fired is None else len(story.fired),
        "last_fired": None
        if not story.fired
        else {"seconds": story.fired[-1][0], "facts": story.fired[-1][1]},
    }
    if story.diagnosis is not None and story.snapshot is not None:
        result |= asdict(story.diagnosis)
        result |= {
            "env": story.snapshot.env,
            "clips_matches": list(story.snapshot.own_counts),
            "on_agenda": story.waiting,
            "ahead_on_agenda": None if story.ahead is None else [asdict(item) for item in story.ahead],
            "halted": story.snapshot.halted,
        }
    return result


def headline(story: RuleExplanation) -> str:
    """Return the answer in one line: whether the rule has fired, and the cause."""
    if story.missing:
        return f"rule {story.rule}: {story.missing}"
    diagnosis = story.diagnosis
    failing = diagnosis.failing if diagnosis is not None else 0
    if diagnosis is None or not failing or diagnosis.failure is None:
        return f"rule {story.rule}: {verdict(story)}"
    has = "has not fired" if not story.fired else "does not fire again"
    near = next((miss.deviations for miss in diagnosis.failure.near if miss.deviations), ())
    slots = [f"{each.slot} is {each.value}, not {each.wanted}" for each in near]
    facts = diagnosis.failure.facts[:1] + diagnosis.failure.values[:1]
    details = "; ".join([*facts, *slots])
    reason = diagnosis.failure.reason + (f": {details}" if details else "")
    return f"rule {story.rule} {has}: CE {failing} {diagnosis.failure.text} has no match: {reason}"


def verdict(story: RuleExplanation) -> str:
    """Return in a sentence why the rule does not fire."""
    diagnosis, snapshot = story.diagnosis, story.snapshot
    if story.unknown:
        return f"whether its condition matches is not known: {story.unknown}"
    if diagnosis is None or snapshot is None:
        return f"there is no such rule: {story.missing}"
    if diagnosis.unknown:
        return f"why it has not fired cannot be told in full: {diagnosis.unknown}"
    if diagnosis.failing:
        return f"its condition does not match: CE {diagnosis.failing} has no match" + (
            " with those before it" if diagnosis.failing > 1 else ""
        )
    return _verdict_of_matches(story, diagnosis, snapshot)


def _verdict_of_matches(story: RuleExplanation, diagnosis: Diagnosis, snapshot: Snapshot) -> str:
    """Return in a sentence why the complete matches do not make the rule fire."""
    ways = _ways(diagnosis.matches)
    if story.waiting:
        verb = "is" if story.waiting == 1 else "are"
        turn = "it is the next to fire" if story.ahead == () else "many others come first"
        if story.ahead:
            first = story.ahead[0]
            turn = f"it comes after {len(story.ahead)} others, first {first.rule} (salience {first.salience})"
        stopped = f"; but no rule fires any more: {snapshot.halted}" if snapshot.halted else ""
        return f"{ways}, {story.waiting} of them {verb} on the agenda: {turn}{stopped}"
    if story.waiting is None and story.fired is None:
        return f"{ways}; whether it has fired for them was not recorded (level rules)"
    fired_bases = {basis for _, basis in story.fired or ()}
    left = [basis for basis in diagnosis.bases if basis not in fired_bases] if story.waiting is None else []
    if left:
        return f"{ways}, and it had not fired for {len(left)} of them, first {left[0]}"
    them = "it" if diagnosis.matches == Count(1) else "all of them"
    return f"{ways}, and it has fired for {them}: it fires again when one of the facts is asserted anew"


def _ways(count: Count | None) -> str:
    return "its condition matches" + (" in one way" if count == Count(1) else f" in {count} ways")


def lines(story: RuleExplanation) -> Iterator[str]:
    """Yield the text of the report."""
    about = [str(story.place)] if story.place else []
    diagnosis, snapshot = story.diagnosis, story.snapshot
    yield headline(story)
    yield ""
    if diagnosis is not None and diagnosis.salience:
        about.append(f"salience {diagnosis.salience}")
    yield f"rule {story.rule}{_bracketed(about)}"
    yield f"in {story.where}"
    yield ""
    if story.fired is not None and not story.missing:
        yield _fired(story.fired)
    yield _capital(f"{verdict(story)}.")
    if diagnosis is not None and snapshot is not None:
        yield from _details(story, diagnosis, snapshot)
    for note in story.notes:
        yield f"note: {note}"


def _fired(fired: tuple[tuple[float, str], ...]) -> str:
    if not fired:
        return "It has not fired."
    times = "once" if len(fired) == 1 else f"{len(fired)} times, last"
    seconds, basis = fired[-1]
    return f"It has fired {times} at {seconds:.3f} s{f' for {basis}' if basis else ''}."


def _details(story: RuleExplanation, diagnosis: Diagnosis, snapshot: Snapshot) -> Iterator[str]:
    if diagnosis.elements:
        yield ""
        yield from _table(diagnosis.elements, diagnosis.failing)
    if diagnosis.unknown and snapshot.own_counts:
        yield ""
        yield "CLIPS' own (matches), where patterns are counted through all groups:"
        yield from (f"  {line}" for line in snapshot.own_counts)
    if diagnosis.failure is not None:
        yield ""
        yield from _failure(diagnosis.failure, f"CE {diagnosis.failing}: ", "  ")
    elif diagnosis.bases:
        yield ""
        yield "it matches for"
        fired_at = {basis: seconds for seconds, basis in story.fired or ()}
        for basis in diagnosis.bases[:MOST_BASES]:
            yield f"  {basis}{f'  fired at {fired_at[basis]:.3f} s' if basis in fired_at else ''}"
        if len(diagnosis.bases) > MOST_BASES:
            yield "  and more"
    for error in diagnosis.errors[:MOST_BASES]:
        yield f"CLIPS, on evaluating the condition: {error}"


def _table(elements: tuple[CECount, ...], failing: int) -> Iterator[str]:
    rows = [
        (
            str(element.number),
            "" if element.alone is None else str(element.alone),
            "" if element.joined is None else str(element.joined),
            element.text,
        )
        for element in elements
    ]
    widths = [max(len(title), *(len(row[column]) for row in rows)) for column, title in enumerate(_TITLES)]
    yield "  " + "  ".join(title.rjust(width) for title, width in zip(_TITLES, widths, strict=True))
    for row, element in zip(rows, elements, strict=True):
        mark = ">" if element.number == failing else " "
        cells = [cell.rjust(width) for cell, width in zip(row[:3], widths, strict=True)]
        yield mark + " " + "  ".join([*cells, row[3]])


_TITLES = ("CE", "alone", "joined")


def _failure(failure: MatchFailure, title: str, indent: str) -> Iterator[str]:
    yield f"{title}{failure.reason}"
    for miss in failure.near:
        yield f"{indent}{miss.fact}"
        for deviation in miss.deviations:
            known = " where " + ", ".join(deviation.known) if deviation.known else ""
            yield f"{indent}  {deviation.slot} is {deviation.value}, not {deviation.wanted}{known}"
    for text in (*failure.facts, *failure.values):
        yield f"{indent}{text}"
    for inner in failure.inner:
        yield from _failure(inner, f"{indent}{inner.text}: ", indent + "  ")


def _bracketed(texts: list[str]) -> str:
    return f" ({', '.join(texts)})" if texts else ""


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
