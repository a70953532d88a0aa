"""Describes a path of choices: ``deliver fails the second time while robot2 executes charge``."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Final

from cxbridge.clock import MICROSECONDS
from cxbridge_explore.counterexample_playing import Played
from cxbridge_explore.properties.monitor import Violation
from cxbridge_explore.worlds.points import USUAL, Choice, ChoiceKind

_CALL: Final = re.compile(r"(?P<who>[^:]*): (?P<skill>[\w.]+)\{(?P<args>.*)\}\Z", re.DOTALL)
_ORDINALS: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


def skill_of(choice: Choice) -> tuple[str, str, str] | None:
    """Return Skiller, skill and arguments of a choice about a skill; None for another choice."""
    match = _CALL.match(choice.point.subject) if choice.point.kind is ChoiceKind.SKILL else None
    return None if match is None else (match["who"], match["skill"], match["args"])


def in_words(played: Played, violation: Violation) -> str:
    """Describe the unusual events of a run and the violation in a sentence."""
    times: dict[tuple[str, str], list[str]] = {}
    for event, time, where in _choices(played):
        times.setdefault((event, where), []).append(time)
    parts = [
        f"{event} the {_listed(which)} time{where}" if which[0] else f"{event}{where}"
        for (event, where), which in times.items()
    ]
    event = ", and ".join(parts) if parts else "without any fault"
    return f"{event}: {violation.message} (at {violation.seconds:.2f} s)"


def _listed(words: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _choices(played: Played) -> Iterator[tuple[str, str, str]]:
    """Yield event, count, and place or time of each unusual choice."""
    counts: dict[str, int] = {}
    several = len({skill[0] for each in played.choices if (skill := skill_of(each)) is not None}) > 1
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
        where = f" on {performer}" if several else ""
        yield (
            f"{called}{arguments} {name}",
            ordinal(counts[key]),
            where + _concurrent_skills(played, choice, performer),
        )


def _concurrent_skills(played: Played, choice: Choice, performer: str) -> str:
    now = round(choice.point.seconds * MICROSECONDS)
    skiller = performer.rpartition("/")[2]
    concurrent_skills = sorted(
        {
            f"{call.skiller} executes {call.skill_string}"
            for call in played.history.calls
            if call.skiller != skiller and call.begin[1] <= now and (call.end is None or call.end[1] > now)
        }
    )
    return f" while {' and '.join(concurrent_skills)}" if concurrent_skills else ""


def ordinal(number: int) -> str:
    if number <= len(_ORDINALS):
        return _ORDINALS[number - 1]
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
