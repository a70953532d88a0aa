"""Filters the goals and rows of the monitor by a text, and formats durations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from cxbridge.history.forest import Forest, parent_id
from cxbridge_studio.monitor.snapshot import MAX_ROWS, GoalRow, Table

_MINUTE_S: Final = 60
_HOUR_S: Final = 3600


def duration_text(seconds: float) -> str:
    """Return a duration as text: ``5.3 s``, ``2 min 05.3 s``, ``1 h 02 min 05 s``."""
    seconds = round(seconds, 1)  # first: 59.96 s is a minute
    if seconds < _MINUTE_S:
        return f"{seconds:.1f} s"
    hours, seconds = divmod(seconds, _HOUR_S)
    minutes, seconds = divmod(seconds, _MINUTE_S)
    if hours:
        return f"{hours:.0f} h {minutes:02.0f} min {seconds:02.0f} s"
    return f"{minutes:.0f} min {seconds:04.1f} s"


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
    matching = (key for key, goal in by_id.items() if has_words(words, goal[1:]))
    selected = goal_forest(goals).goals_with_ancestors(matching)
    return [goal for key, goal in by_id.items() if key in selected]


def goal_forest(goals: Iterable[GoalRow]) -> Forest[tuple[str, str]]:
    """Return the forest of goals, by environment and id."""
    return Forest(
        {
            (goal.env, goal.id): None if (parent := parent_id(goal.parent)) is None else (goal.env, parent)
            for goal in goals
        }
    )


def page(rows: Iterable[tuple[str, ...]], words: str, noun: str) -> Table:
    """Return the first rows that contain a text, and a note about further rows.

    :param noun: the noun for the rows in the note.
    """
    matching = [row for row in rows if has_words(words, row)]
    further = len(matching) - MAX_ROWS
    return Table(matching[:MAX_ROWS], f"{further} more {noun}: / finds them" if further > 0 else "")
