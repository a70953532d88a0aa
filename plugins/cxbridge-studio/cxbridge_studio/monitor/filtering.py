"""The filter of goals and rows, and the text of durations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from cxbridge.history.forest import Forest, parent_id
from cxbridge_studio.monitor.snapshot import MAX_ROWS, GoalRow, Table

_MINUTE_S: Final = 60
_HOUR_S: Final = 3600


def duration_text(seconds: float) -> str:
    """Return a duration as text: ``5.3 s``, ``2 min 05.3 s``, ``1 h 02 min 05 s``."""
    seconds = round(seconds, 1)
    if seconds < _MINUTE_S:
        return f"{seconds:.1f} s"
    hours, rest = divmod(seconds, _HOUR_S)
    minutes, rest = divmod(rest, _MINUTE_S)
    if hours:
        return f"{hours:.0f} h {minutes:02.0f} min {rest:02.0f} s"
    return f"{minutes:.0f} min {rest:04.1f} s"


def has_words(words: str, cells: Iterable[str]) -> bool:
    """Return whether a text is in the cells, joined by blanks.

    :param words: in lower case; the empty text is in all cells.
    """
    return not words or words in " ".join(cells).lower()


def filter_goals(goals: Sequence[GoalRow], words: str) -> Sequence[GoalRow]:
    """Return the goals that contain a text, with all their parents."""
    if not words:
        return goals
    by_id = {(goal.env, goal.id): goal for goal in goals}
    shown_goals = goal_forest(goals).with_those_above(
        key for key, goal in by_id.items() if has_words(words, goal[1:])
    )
    return [goal for key, goal in by_id.items() if key in shown_goals]


def goal_forest(goals: Iterable[GoalRow]) -> Forest[tuple[str, str]]:
    """Return the forest of goals, by environment and id."""
    parents = {
        (goal.env, goal.id): None if (above := parent_id(goal.parent)) is None else (goal.env, above)
        for goal in goals
    }
    return Forest(parents)


def page(rows: Iterable[tuple[str, ...]], words: str, noun: str) -> Table:
    """Return the first rows that contain a text, and a note about further rows.

    :param noun: the noun for the rows in the note.
    """
    shown: list[tuple[str, ...]] = []
    remaining = 0
    for row in rows:
        if has_words(words, row):
            if len(shown) < MAX_ROWS:
                shown.append(row)
            else:
                remaining += 1
    return Table(shown, f"{remaining} more {noun}: / finds them" if remaining else "")
