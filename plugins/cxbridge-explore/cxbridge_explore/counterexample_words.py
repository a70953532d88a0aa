"""Describes a path of choices: ``deliver fails the second time while robot2 executes charge``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge_explore.counterexample_playing import PlayedRun
from cxbridge_explore.properties.monitor import Violation
from cxbridge_explore.worlds.points import USUAL, Choice, ChoiceKind

_CALL: Final = re.compile(r"(?P<skiller>[^:]*): (?P<skill>[\w.]+)\{(?P<args>.*)\}\Z", re.DOTALL)
_ORDINALS: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


def skill_of(choice: Choice) -> tuple[str, str, str] | None:
    """Return Skiller, skill and arguments of a choice about a skill; None for another choice."""
    match = _CALL.match(choice.point.subject) if choice.point.kind is ChoiceKind.SKILL else None
    return None if match is None else (match["skiller"], match["skill"], match["args"])


def in_words(played: PlayedRun, violation: Violation) -> str:
    """Describe the unusual events of a run and the violation in a sentence."""
    ordinals: dict[tuple[str, str], list[str]] = {}
    for event, count, circumstances in _choices(played):
        ordinals.setdefault((event, circumstances), []).append(count)
    phrases = [
        f"{event} the {_enumeration(counts)} time{circumstances}" if counts[0] else f"{event}{circumstances}"
        for (event, circumstances), counts in ordinals.items()
    ]
    events = ", and ".join(phrases) if phrases else "without any fault"
    return f"{events}: {violation.message} (at {violation.seconds:.2f} s)"


def _enumeration(words: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _choices(played: PlayedRun) -> Iterator[tuple[str, str, str]]:
    """Yield event, count, and place or time of each unusual choice."""
    counts: dict[str, int] = {}
    skillers = {skill[0] for choice in played.choices if (skill := skill_of(choice)) is not None}
    several = len(skillers) > 1
    for choice in played.choices:
        skill = skill_of(choice)
        key = choice.point.subject if skill is None else "/".join(skill[: 2 if several else 1] + skill[1:2])
        counts[key] = counts.get(key, 0) + 1
        if choice.option == USUAL:
            continue
        name = choice.taken.name
        if skill is None:
            yield f"{choice.point.subject} {name}", "", f" at {choice.point.seconds:.2f} s"
            continue
        performer, called, args = skill
        arguments = f" ({args})" if args else ""
        skiller = f" on {performer}" if several else ""
        yield (
            f"{called}{arguments} {name}",
            ordinal(counts[key]),
            skiller + _concurrent_skills(played, choice, performer),
        )


def _concurrent_skills(played: PlayedRun, choice: Choice, performer: str) -> str:
    now = round(choice.point.seconds * MICROSECONDS)
    skiller = performer.rpartition("/")[2]
    # The history has Skillers without the agent's name before the slash.
    concurrent_skills = sorted(
        {
            f"{call.skiller} executes {call.skill_string}"
            for call in played.history.calls
            if call.skiller != skiller and call.begin[1] <= now and (call.end is None or call.end[1] > now)
        }
    )
    return f" while {' and '.join(concurrent_skills)}" if concurrent_skills else ""


def ordinal(number: int) -> str:
    """Return an ordinal number as a word, or with its ending: ``first``, ``21st``."""
    if number <= len(_ORDINALS):
        return _ORDINALS[number - 1]
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
