"""Describes a run in a sentence: ``deliver fails the second time: ...``."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Sequence
from typing import Final, NamedTuple

from cxbridge_explore.properties.monitor import Violation
from cxbridge_explore.worlds.points import USUAL, Choice, ChoiceKind

# The subject of a choice about a skill: `Skiller: deliver{wp='wp1'}`.
_CALL_SUBJECT: Final = re.compile(r"(?P<skiller>[^:]*): (?P<skill>[\w.]+)\{(?P<args>.*)\}\Z", re.DOTALL)
_ORDINALS: Final = ("first", "second", "third", "fourth", "fifth", "sixth", "seventh", "eighth", "ninth")


class _ChosenSkill(NamedTuple):
    """A skill call whose result the world has chosen."""

    skiller: str
    skill: str
    arguments: str


def _find_chosen_skill(choice: Choice) -> _ChosenSkill | None:
    """Return the skill call of a choice; None if the choice is not about a skill call."""
    match = _CALL_SUBJECT.match(choice.point.subject) if choice.point.kind is ChoiceKind.SKILL else None
    return None if match is None else _ChosenSkill(match["skiller"], match["skill"], match["args"])


def describe_run(choices: Sequence[Choice], violation: Violation) -> str:
    """Describe the unusual events of a run and the violation in a sentence."""
    ordinals_of_events: dict[tuple[str, str], list[str]] = {}
    for event, ordinal_number, circumstances in _find_unusual_events(choices):
        ordinals_of_events.setdefault((event, circumstances), []).append(ordinal_number)
    phrases = [
        f"{event} the {_join_words(ordinals)} time{circumstances}"
        if ordinals[0]
        else f"{event}{circumstances}"
        for (event, circumstances), ordinals in ordinals_of_events.items()
    ]
    events = ", and ".join(phrases) if phrases else "without any fault"
    return f"{events}: {violation.message} (at {violation.seconds:.2f} s)"


def _join_words(words: list[str]) -> str:
    return " and ".join(filter(None, (", ".join(words[:-1]), words[-1])))


def _find_unusual_events(choices: Sequence[Choice]) -> Iterator[tuple[str, str, str]]:
    """Yield the event, the ordinal number and the circumstances of each unusual choice.

    The ordinal number is empty for an event that is not a skill call.
    """
    counts: Counter[tuple[ChoiceKind, str]] = Counter()
    skillers = {skill.skiller for choice in choices if (skill := _find_chosen_skill(choice)) is not None}
    has_several_skillers = len(skillers) > 1
    for choice in choices:
        skill = _find_chosen_skill(choice)
        # the sentence names the arguments, so calls with other arguments do not count
        key = choice.point.kind, choice.point.subject
        counts[key] += 1
        if choice.option_index == USUAL:
            continue
        name = choice.taken_option.name
        if skill is None:
            yield f"{choice.point.subject} {name}", "", f" at {choice.point.seconds:.2f} s"
            continue
        arguments = f" ({skill.arguments})" if skill.arguments else ""
        place = f" on {skill.skiller}" if has_several_skillers else ""
        yield f"{skill.skill}{arguments} {name}", format_ordinal(counts[key]), place


def format_ordinal(number: int) -> str:
    """Return an ordinal number: a word such as ``first`` up to nine, then digits as in ``21st``."""
    if number <= len(_ORDINALS):
        return _ORDINALS[number - 1]
    ending = "th" if number % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(number % 10, "th")
    return f"{number}{ending}"
