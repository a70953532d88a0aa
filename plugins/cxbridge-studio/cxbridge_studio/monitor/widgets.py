"""The widgets of the monitor's screen: the tree of goals, tables, and the log.

The monitor shows a new snapshot several times a second. A widget whose content is the same is not rebuilt, so
that the terminal does not flicker. A rebuilt tree or table restores its cursor and scroll position.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from rich.text import Text
from textual.widgets import DataTable, RichLog, Tree
from textual.widgets.tree import TreeNode

from cxbridge.history.outcome import OutcomeKind, action_outcome, skill_outcome
from cxbridge.history.tree import goal_line
from cxbridge.printing import indent_lines, one_line
from cxbridge_studio.monitor.filtering import make_goal_forest
from cxbridge_studio.monitor.snapshot import MAX_LINES, GoalRow, LogRow, Table

# the colours of cells, by the whole text of the cell: an outcome, a state or a status
_COLOURS: Final = {
    **{outcome.name: outcome.colour for outcome in OutcomeKind},
    **{state: action_outcome(state).colour for state in ("FINAL", "EXECUTION-FAILED")},
    **{status: skill_outcome(status).colour for status in ("S_RUNNING", "S_FINAL", "S_FAILED")},
}
_GUIDE_WIDTH: Final = 2  # the columns per level of the tree
_STATE_WIDTH: Final = 10  # the columns of the state
_MAX_CELL_LENGTH: Final = 200  # limit of characters: only the selected row is shown in full
_LEVEL_STYLES: Final = {"D": "dim", "I": "", "W": "yellow", "E": "red"}  # by the letter of the log level

GoalKey = tuple[str, str]  # the environment and the id of a goal; an empty id means the environment


class GoalTree(Tree[GoalKey]):
    """The tree of goals. It is rebuilt only if goals are added, removed or moved, or change their class."""

    def __init__(self) -> None:
        super().__init__("goals", id="goals")
        self.guide_depth = _GUIDE_WIDTH
        self._goals: dict[GoalKey, GoalRow] = {}
        self._goal_nodes: dict[GoalKey, TreeNode[GoalKey]] = {}
        self._goal_structure: list[tuple[GoalKey, str, str]] | None = None

    @property
    def item_at_cursor(self) -> GoalRow | None:
        """The goal under the cursor; None if there is none, e.g. on the line of an environment."""
        node = self.cursor_node
        return None if node is None or node.data is None else self._goals.get(node.data)

    def show(self, goals: Sequence[GoalRow]) -> None:
        rows = {(goal.env, goal.id): goal for goal in goals}
        structure = [(key, goal.parent, goal.goal_class) for key, goal in rows.items()]
        previous_rows, self._goals = self._goals, rows
        if structure != self._goal_structure:
            self._goal_structure = structure
            self._build_goals(rows)
            return
        for key, row in rows.items():
            if previous_rows[key] != row:
                self._goal_nodes[key].set_label(self._make_goal_label(row))

    def _build_goals(self, rows: dict[GoalKey, GoalRow]) -> None:
        cursor_key = self.cursor_node.data if self.cursor_node is not None else None
        scroll_position = self.scroll_y
        self.clear()
        self._goal_nodes = {}
        forest = make_goal_forest(rows.values())
        envs = list(dict.fromkeys(env for env, _ in rows))
        for env in envs:
            env_node = (
                self.root
                if len(envs) == 1
                else self.root.add(Text(one_line(env)), data=(env, ""), expand=True)
            )
            for key, _ in forest.walk(key for key in forest.roots if key[0] == env):
                parent, is_leaf = forest.parents[key], key not in forest.children
                parent_node = env_node if parent is None else self._goal_nodes[parent]
                label = self._make_goal_label(rows[key])
                node = parent_node.add(label, data=key, expand=not is_leaf, allow_expand=not is_leaf)
                self._goal_nodes[key] = node
        self.root.expand()
        if cursor_key in self._goal_nodes:
            # the new nodes get their lines in the refresh
            self.call_after_refresh(self._restore_cursor, cursor_key, scroll_position)

    @staticmethod
    def _make_goal_label(goal: GoalRow) -> Text:
        """Return the label; the state precedes the title, so that a narrow tree shows all states."""
        line = goal_line("", goal.id, goal)
        label = Text(f"{line.outcome.icon} ", line.outcome.colour)
        label.append(one_line(f"{line.state:{_STATE_WIDTH}} "), line.outcome.colour)
        label.append(one_line(line.title))
        if line.state != goal.mode:
            label.append(one_line(f" {goal.mode}"), "dim")
        if goal.error:
            label.append(one_line(f"  {goal.error}"), "red")
        return label

    def _restore_cursor(self, key: GoalKey, scroll_position: float) -> None:
        """Move the cursor back to a goal, if the goal still exists."""
        node = self._goal_nodes.get(key)
        if node is not None:
            self.move_cursor(node)
            self.scroll_to(y=scroll_position, animate=False, immediate=True)
            self.scroll_to_node(node, animate=False)


class RowTable(DataTable[Text]):
    """A table that is rebuilt only if rows have changed.

    :param name: the id of the table.
    :param columns: the titles of the columns.
    """

    def __init__(self, name: str, columns: Sequence[str]) -> None:
        super().__init__(id=name, cursor_type="row")
        self._titles = columns
        self._shown_rows: list[tuple[str, ...]] = []

    def on_mount(self) -> None:
        self.add_columns(*self._titles)

    @property
    def item_at_cursor(self) -> tuple[str, ...] | None:
        """The row under the cursor; None in an empty table."""
        return self._shown_rows[self.cursor_row] if 0 <= self.cursor_row < len(self._shown_rows) else None

    def show(self, table: Table) -> None:
        rows = list(table.rows)
        if rows == self._shown_rows:
            self._select(table.selected)
            return
        selected_row, cursor, scroll_position = self.item_at_cursor, self.cursor_row, self.scroll_y
        self._shown_rows = rows
        self.clear()
        self.add_rows([_make_cell(cell) for cell in row] for row in rows)
        self.scroll_to(y=scroll_position, animate=False, immediate=True)
        if table.selected is not None:
            self._select(table.selected)
        elif selected_row is not None and rows:
            # The cursor follows the row with the same first cell. If several rows have that cell, and the
            # cursor is at one of them, the cursor stays.
            cursor = min(cursor, len(rows) - 1)
            indices = [index for index, row in enumerate(rows) if row[0] == selected_row[0]]
            self.move_cursor(row=cursor if cursor in indices or not indices else indices[0], scroll=False)

    def _select(self, row: int | None) -> None:
        """Move the cursor to a row, centred in the view; None leaves the cursor where it is."""
        if row is not None and row != self.cursor_row:
            self.move_cursor(row=row, scroll=False)
            self.call_after_refresh(self._scroll_around, row)

    def _scroll_around(self, row: int) -> None:
        self.scroll_to(y=max(0, row - self.size.height // 2), animate=False, immediate=True)


class LogLines(RichLog):
    """The log of a daemon, or of a recording up to the current position."""

    def __init__(self) -> None:
        # more than the log lines of a snapshot: here, each row of a wrapped line counts
        super().__init__(id="log", wrap=True, max_lines=2 * MAX_LINES)
        self._last_row: LogRow | None = None

    def show(self, rows: Sequence[LogRow]) -> None:
        """Show log lines: append the new lines, or start again if the last shown line is not among them.

        That line is missing after a move back in a recording, or after a restart of the daemon.
        """
        last_row = rows[-1] if rows else None
        if last_row == self._last_row:
            return
        last_index = rows.index(self._last_row) if self._last_row in rows else -1
        if self._last_row is not None and last_index < 0:
            self.clear()
        self._last_row = last_row
        for row in rows[last_index + 1 :]:
            self.write(Text(indent_lines(row.text), style=_LEVEL_STYLES.get(row.level, "")))


def _make_cell(text: str) -> Text:
    """Return a one-line cell for a text of any length."""
    line = " ".join(text[:_MAX_CELL_LENGTH].splitlines())
    ellipsis = " ..." if len(text) > _MAX_CELL_LENGTH else ""
    return Text(one_line(line) + ellipsis, style=_COLOURS.get(text, ""), no_wrap=True)


def make_progress_bar(progress: float, width: int) -> str:
    """Return a progress bar as text.

    :param progress: the progress from 0 to 1.
    :param width: the number of characters, at least 3.
    """
    inner_width = max(1, width - 2)
    position = min(inner_width - 1, int(progress * inner_width))
    return "[" + "=" * position + "|" + "-" * (inner_width - 1 - position) + "]"
