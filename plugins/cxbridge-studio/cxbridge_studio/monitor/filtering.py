"""Filters the goals and rows of the monitor by a text, and formats durations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from cxbridge.history.forest import Forest, parent_id
from cxbridge_studio.monitor.snapshot import MAX_ROWS, GoalRow, Table

_MINUTE_S: Final = 60
_HOUR_S: Final = 3600


def format_duration(seconds: float) -> str:
    """Return a duration as text: ``5.3 s``, ``2 min 05.3 s``, ``1 h 02 min 05 s``."""
    # rounded before the divisions, so that 59.96 s is shown as a minute, not as 60.0 s
    seconds = round(seconds, 1 if seconds < _HOUR_S else 0)
    if seconds < _MINUTE_S:
        return f"{seconds:.1f} s"
    hours, seconds = divmod(seconds, _HOUR_S)
    minutes, seconds = divmod(seconds, _MINUTE_S)
    if hours:
        return f"{hours:.0f} h {minutes:02.0f} min {seconds:02.0f} s"
    return f"{minutes:.0f} min {seconds:04.1f} s"


def contains_text(filter_text: str, cells: Iterable[str]) -> bool:
    """Return whether a text is in the cells, joined by blanks.

    :param filter_text: the text in lower case; the empty text is in all cells.
    """
    return not filter_text or filter_text in " ".join(cells).lower()


def filter_goals(goals: Sequence[GoalRow], filter_text: str) -> Sequence[GoalRow]:
    """Return the goals that contain a text, and all their ancestors."""
    if not filter_text:
        return goals
    goals_by_id = {(goal.env, goal.id): goal for goal in goals}
    # The text may be in any field after the environment.
    matching_keys = (key for key, goal in goals_by_id.items() if contains_text(filter_text, goal[1:]))
    selected_keys = make_goal_forest(goals).goals_with_ancestors(matching_keys)
    return [goal for key, goal in goals_by_id.items() if key in selected_keys]


def make_goal_forest(goals: Iterable[GoalRow]) -> Forest[tuple[str, str]]:
    """Return the goals as trees; the key of a goal is its environment and its id."""
    return Forest(
        {
            (goal.env, goal.id): None if (parent := parent_id(goal.parent)) is None else (goal.env, parent)
            for goal in goals
        }
    )


def make_filtered_table(rows: Iterable[tuple[str, ...]], filter_text: str, noun: str) -> Table:
    """Return a table of the first rows that contain a text, with a note about further rows.

    :param noun: the noun for the rows in the note.
    """
    matching_rows = [row for row in rows if contains_text(filter_text, row)]
    further_count = len(matching_rows) - MAX_ROWS
    return Table(
        matching_rows[:MAX_ROWS], f"{further_count} more {noun}: / finds them" if further_count > 0 else ""
    )
