"""The planned actions, which are the steps of a plan, and the notation of plans in recordings.

A plan has two notations: the notation of plan files, with few decimals (``str`` of a planned action), and
the notation of recordings, with exact times (:func:`plan_text`).
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final, NamedTuple

_DECIMALS: Final = 3  # of times in plan files
# START: (NAME ARGUMENT...) [DURATION]; possessive quantifiers bound the time for any text. A bracket after
# the duration is accepted since plan files of programs such as LPG are read.
_ACTION_PATTERN: Final = re.compile(
    r"\s*+(?:([^\s():]++)\s*+:)?\s*+\(\s*+([^\s()]++)([^()]*+)\)\s*+(?:\[\s*+([^\s\]]++)\s*+\]\s*+\)?\s*+)?"
)


class PlannedAction(NamedTuple):
    """A planned action: a step of a plan.

    :param start: the start in seconds after the plan's start; None in an untimed plan.
    :param duration: the planned duration in seconds; None for an action without duration.
    """

    name: str
    arguments: tuple[str, ...] = ()
    start: float | None = None
    duration: float | None = None

    def __str__(self) -> str:
        """Return the action in the notation of plan files."""
        text = f"({' '.join((self.name, *self.arguments))})"
        if self.start is not None:
            text = f"{_format_seconds(self.start)}: {text}"
        return text if self.duration is None else f"{text} [{_format_seconds(self.duration)}]"


def _format_seconds(time_s: float) -> str:
    """Return a time with the three decimals of plan files, or up to nine decimals if the time has more."""
    # rounding to three decimals could swap the order of two times; floats have noise after many decimals
    text = f"{time_s:.9f}".rstrip("0")
    return text if len(text.partition(".")[2]) > _DECIMALS else f"{time_s:.{_DECIMALS}f}"


def plan_text(actions: Iterable[PlannedAction]) -> str:
    """Return a plan with a line ``START: (NAME ARGUMENT...) [DURATION]`` for each action.

    An action without times has only the part in parentheses.
    """
    return "\n".join(map(_format_action, actions))


def parse_plan_text(text: str) -> tuple[PlannedAction, ...]:
    """Parse a plan from :func:`plan_text`.

    :raises ValueError: if a line is not an action.
    """
    return tuple(map(_parse_action, text.splitlines()))


def _format_action(action: PlannedAction) -> str:
    # repr() of a float parses to exactly the same float
    start = "" if action.start is None else f"{action.start!r}: "
    duration = "" if action.duration is None else f" [{action.duration!r}]"
    return f"{start}({' '.join((action.name, *action.arguments))}){duration}"


def _parse_action(line: str) -> PlannedAction:
    match = _ACTION_PATTERN.fullmatch(line)
    if match is None:
        raise ValueError(f"not an action of a plan: {line!r}")
    start, name, arguments, duration = match.groups()
    return PlannedAction(
        name,
        tuple(arguments.split()),
        None if start is None else float(start),
        None if duration is None else float(duration),
    )
