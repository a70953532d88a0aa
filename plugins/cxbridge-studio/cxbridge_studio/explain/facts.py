"""Explains where a fact comes from: the rules that fired just before it was asserted, and retracted."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge_studio.explain.evidence import Evidence, FactLife

_INDEX: Final = re.compile(r"(?:f-)?(\d+)")
_RECORD: Final = "record with --trace-level facts"


@dataclass(frozen=True, slots=True)
class FactStory:
    """The report about a fact.

    :param before: the fact that the same rule firing retracted, of the same template: ``modify`` does so.
    """

    where: str
    life: FactLife
    before: FactLife | None
    begin_s: float
    end_s: float | None

    @property
    def headline(self) -> str:
        """Return in one line which rule the fact comes from."""
        changed = f", instead of f-{self.before.index}" if self.before is not None else ""
        return f"f-{self.life.index} was asserted at {self.begin_s:.3f} s{changed}: {_by(self.life.rule)}"

    @property
    def ending(self) -> str:
        """Return in one line how the fact ended."""
        if self.end_s is None:
            return "it is still there"
        return f"it was retracted at {self.end_s:.3f} s: {_by(self.life.end_rule)}"


def _by(rule: str) -> str:
    return f"rule {rule} fired just before" if rule else "no rule is known to have fired before"


def explain_fact(evidence: Evidence, name: str) -> FactStory:
    """Report a fact by its index: ``f-12``.

    :raises CxbridgeError: when it is not known, with what to record.
    """
    match = _INDEX.fullmatch(name)
    if match is None:
        raise CxbridgeError(f"'{name}' is not a fact", hint="name its index: f-12")
    history = evidence.history
    if history is None or not history.lives:
        raise CxbridgeError(
            f"where f-{match[1]} comes from is not known: facts are not recorded", hint=_RECORD
        )
    life = history.lives.get(int(match[1]))
    if life is None:
        hint = f"those from f-{min(history.lives)} to f-{max(history.lives)} are known"
        raise CxbridgeError(f"there is no fact f-{match[1]} up to here", hint=hint)
    previous_life = history.lives.get(life.instead_of)
    end_s = None if life.end_us is None else evidence.seconds(life.end_us)
    return FactStory(evidence.where, life, previous_life, evidence.seconds(life.begin_us), end_s)


def plain(story: FactStory) -> dict[str, Any]:
    """Return a story as values that JSON knows."""
    rules = [rule for rule in (story.life.rule, story.life.end_rule) if rule]
    because = [{"text": text, "because": []} for text in _details(story)]
    return {
        "headline": story.headline,
        "where": story.where,
        "cause": {"text": story.headline, "because": because},
        "rules": rules,
        "moments": [],
        "notes": [],
    }


def _details(story: FactStory) -> Iterator[str]:
    yield story.life.text
    if story.before is not None:
        yield f"instead of f-{story.before.index} {story.before.text}"
    yield story.ending


def lines(story: FactStory) -> Iterator[str]:
    """Yield the report for people."""
    yield story.headline
    yield f"in {story.where}"
    yield ""
    yield from _details(story)
