"""Plans as text with exact times, one action per line."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from cxbridge.executive.planning.planner import PlannedAction

_ACTION: Final = re.compile(
    r"\s*+(?:([^\s():]++)\s*+:)?\s*+\(\s*+([^\s()]++)([^()]*+)\)\s*+(?:\[\s*+([^\s\]]++)\s*+\]\s*+\)?\s*+)?"
)


def plan_text(actions: Iterable[PlannedAction]) -> str:
    """Return a plan as ``START: (NAME ARGUMENT...) [DURATION]``, without missing times."""
    return "\n".join(map(_line, actions))


def parse_plan_text(text: str) -> tuple[PlannedAction, ...]:
    """Parse a plan from :func:`plan_text`.

    :raises ValueError: if a line is not an action.
    """
    return tuple(map(_action, text.splitlines()))


def _line(action: PlannedAction) -> str:
    start = "" if action.start is None else f"{action.start!r}: "
    duration = "" if action.duration is None else f" [{action.duration!r}]"
    return f"{start}({' '.join((action.name, *action.arguments))}){duration}"


def _action(line: str) -> PlannedAction:
    match = _ACTION.fullmatch(line)
    if match is None:
        raise ValueError(f"no action of a plan: {line!r}")
    start, name, arguments, duration = match.groups()
    return PlannedAction(
        name,
        tuple(arguments.split()),
        None if start is None else float(start),
        None if duration is None else float(duration),
    )
