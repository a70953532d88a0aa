"""Explains the origin of a fact: the rules that fired just before the fact was asserted, and retracted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.numbers import parse_decimal
from cxbridge_studio.explain.evidence import Evidence, FactLife

_RECORD_HINT: Final = "record with --trace-level facts"


@dataclass(frozen=True, slots=True)
class FactStory:
    """The origin and the end of a fact.

    :param life: the rules and times of the fact's assertion and retraction.
    :param begin_s: the time of the assertion, in seconds since the start of the run.
    :param end_s: the time of the retraction; None while the fact exists.
    :param previous_life: the fact of the same template that the same firing retracted, as ``modify`` does.
    """

    where: str
    life: FactLife
    previous_life: FactLife | None
    begin_s: float
    end_s: float | None
    notes: tuple[str, ...]

    @property
    def headline(self) -> str:
        """The origin of the fact, in one line."""
        changed = f", instead of f-{self.previous_life.index}" if self.previous_life is not None else ""
        rule = _describe_last_firing(self.life.begin_rule)
        return f"f-{self.life.index} was asserted at {self.begin_s:.3f} s{changed}: {rule}"

    def details(self) -> Iterator[str]:
        """Yield the fact, its previous version and its end."""
        yield self.life.text
        if self.previous_life is not None:
            yield f"instead of f-{self.previous_life.index} {self.previous_life.text}"
        if self.end_s is None:
            yield "it still exists"
        else:
            yield f"it was retracted at {self.end_s:.3f} s: {_describe_last_firing(self.life.end_rule)}"


def _describe_last_firing(rule: str) -> str:
    return f"rule {rule} fired just before" if rule else "no rule is known to have fired before"


def explain_fact(evidence: Evidence, name: str) -> FactStory:
    """Return the story of a fact, named by its index: ``f-12``.

    :raises CxbridgeError: if the fact is unknown; the hint says what to record.
    """
    index = parse_decimal(name.removeprefix("f-"))
    if index is None:
        raise CxbridgeError(f"'{name}' is not a fact", hint="name its index: f-12")
    history = evidence.history
    if history is None or not history.fact_lives:
        raise CxbridgeError(f"the origin of f-{index} is unknown: facts are not recorded", hint=_RECORD_HINT)
    life = history.fact_lives.get(index)
    if life is None:
        raise CxbridgeError(f"no fact f-{index} is known before this moment")
    previous_life = history.fact_lives.get(life.replaced_index)
    end_s = None if life.end_us is None else evidence.compute_seconds(life.end_us)
    return FactStory(
        evidence.where,
        life,
        previous_life,
        evidence.compute_seconds(life.begin_us),
        end_s,
        tuple(evidence.notes),
    )


def to_json(story: FactStory) -> dict[str, Any]:
    """Return a story as JSON values, in the form of the stories of goals: the page shows both alike."""
    because = [{"text": text, "because": []} for text in story.details()]
    return {
        "headline": story.headline,
        "where": story.where,
        "cause": {"text": story.headline, "because": because},
        "rules": [rule for rule in (story.life.begin_rule, story.life.end_rule) if rule],
        "moments": [],
        "notes": story.notes,
    }


def format_report(story: FactStory) -> Iterator[str]:
    """Yield the text of the report."""
    yield story.headline
    yield f"in {story.where}"
    yield ""
    yield from story.details()
    yield from (f"note: {note}" for note in story.notes)
