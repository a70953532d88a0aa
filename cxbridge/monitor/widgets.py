"""Parts of the monitor's screen: the tree of goals, tables, the log."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from rich.text import Text
from textual.coordinate import Coordinate
from textual.widgets import DataTable, RichLog, Tree
from textual.widgets.tree import TreeNode

from cxbridge.monitor.choosing import goal_forest
from cxbridge.monitor.snapshot import GoalRow, LogRow, Table
from cxbridge.printing import indented, one_line

_COLOURS: Final = {
    "COMPLETED": "green",
    "FINAL": "green",
    "S_FINAL": "green",
    "FAILED": "red",
    "S_FAILED": "red",
    "EXECUTION-FAILED": "red",
    "REJECTED": "yellow",
    "DISPATCHED": "cyan",
    "RUNNING": "cyan",
    "S_RUNNING": "cyan",
}
_LONGEST: Final = 200
_LEVELS: Final = {"D": "dim", "I": "", "W": "yellow", "E": "red"}

GoalKey = tuple[str, str]
"""Environment and id of a goal; no id: the environment itself."""


class GoalTree(Tree[GoalKey]):
    """Goals below their parents. Built again only when goals come, go or move."""

    def __init__(self) -> None:
        super().__init__("goals", id="goals")
        self.guide_depth = 2
        self._goals: dict[GoalKey, GoalRow] = {}
        self._goal_nodes: dict[GoalKey, TreeNode[GoalKey]] = {}
        self._goal_structure: list[tuple[GoalKey, str]] | None = None

    @property
    def chosen(self) -> GoalRow | None:
        """The goal under the cursor."""
        node = self.cursor_node
        return None if node is None or node.data is None else self._goals.get(node.data)

    def show(self, goals: Sequence[GoalRow]) -> None:
        """Show these goals."""
        rows = {(goal.env, goal.id): goal for goal in goals}
        structure = [(key, goal.parent) for key, goal in rows.items()]
        before, self._goals = self._goals, rows
        if structure != self._goal_structure:
            self._goal_structure = structure
            self._build_goals(rows)
            return
        for key, row in rows.items():
            if before[key] != row:
                self._goal_nodes[key].set_label(_label(row))

    def _build_goals(self, rows: dict[GoalKey, GoalRow]) -> None:
        at = self.cursor_node.data if self.cursor_node is not None else None
        scrolled = self.scroll_y
        self.clear()
        self._goal_nodes = {}
        forest = goal_forest(rows.values())
        envs = list(dict.fromkeys(env for env, _ in rows))
        for env in envs:
            top = (
                self.root
                if len(envs) == 1
                else self.root.add(Text(one_line(env)), data=(env, ""), expand=True)
            )
            for key, _ in forest.walk(key for key in forest.roots if key[0] == env):
                parent, leaf = forest.parents[key], key not in forest.children
                over = top if parent is None else self._goal_nodes[parent]
                node = over.add(_label(rows[key]), data=key, expand=not leaf, allow_expand=not leaf)
                self._goal_nodes[key] = node
        self.root.expand()
        if at in self._goal_nodes:
            self.call_after_refresh(self._return_to, at, scrolled)

    def _return_to(self, key: GoalKey, scrolled: float) -> None:
        """Put the cursor back to a goal, if it is still there."""
        node = self._goal_nodes.get(key)
        if node is not None:
            self.move_cursor(node)
            self.scroll_to(y=scrolled, animate=False, immediate=True)
            self.scroll_to_node(node, animate=False)


class Rows(DataTable[Text]):
    """A table that is brought up to date cell by cell, as far as that goes.

    :param name: also its id.
    :param columns: their titles.
    """

    def __init__(self, name: str, columns: Sequence[str]) -> None:
        super().__init__(id=name, cursor_type="row", show_header=bool(columns[0]))
        self._titles = columns
        self._shown: list[tuple[str, ...]] = []

    def on_mount(self) -> None:
        """Make the columns."""
        self.add_columns(*self._titles)

    @property
    def chosen(self) -> tuple[str, ...] | None:
        """The row under the cursor."""
        return self._shown[self.cursor_row] if 0 <= self.cursor_row < len(self._shown) else None

    def show(self, table: Table) -> None:
        """Show these rows."""
        rows, before = list(table.rows), self._shown
        if rows == before:
            self._mark(table.at)
            return
        chosen, scrolled = self.chosen, self.scroll_y
        self._shown = rows
        if len(rows) == len(before):
            for number, (row, old) in enumerate(zip(rows, before, strict=True)):
                for column, (cell, other) in enumerate(zip(row, old, strict=True)):
                    if cell != other:
                        self.update_cell_at(Coordinate(number, column), _cell(cell), update_width=True)
        else:
            self.clear()
            self.add_rows([_cell(cell) for cell in row] for row in rows)
            self.scroll_to(y=scrolled, animate=False, immediate=True)
        if table.at is not None:
            self._mark(table.at)
        elif chosen is not None and rows:
            at = next((n for n, row in enumerate(rows) if row[0] == chosen[0]), self.cursor_row)
            at = self.cursor_row if rows[min(self.cursor_row, len(rows) - 1)][0] == chosen[0] else at
            self.move_cursor(row=min(at, len(rows) - 1), scroll=False)

    def _mark(self, row: int | None) -> None:
        """Put the cursor to a row, with some rows before and behind it."""
        if row is not None and row != self.cursor_row:
            self.move_cursor(row=row, scroll=False)
            self.call_after_refresh(self._scroll_around, row)

    def _scroll_around(self, row: int) -> None:
        self.scroll_to(y=max(0, row - self.size.height // 2), animate=False, immediate=True)


class LogLines(RichLog):
    """The log up to a moment."""

    def __init__(self) -> None:
        super().__init__(id="log", wrap=True, max_lines=2000)
        self._last: LogRow | None = None

    def show(self, rows: Sequence[LogRow]) -> None:
        """Show these lines: adds what is new, begins again when it goes back."""
        last = rows[-1] if rows else None
        if last == self._last:
            return
        at = -1 if self._last is None else _place(rows, self._last)
        if self._last is not None and at < 0:
            self.clear()
        self._last = last
        for row in rows[at + 1 :]:
            self.write(Text(indented(row.text), style=_LEVELS.get(row.level, "")))


def _place(rows: Sequence[LogRow], row: LogRow) -> int:
    """Return where a row is, -1 when it is not there."""
    return next((at for at in range(len(rows) - 1, -1, -1) if rows[at] == row), -1)


def _cell(text: str) -> Text:
    """Return a cell of one line, of a text of any length."""
    line = " ".join(text[:_LONGEST].splitlines())
    more = " ..." if len(text) > _LONGEST else ""
    return Text(one_line(line) + more, style=_COLOURS.get(text, ""), no_wrap=True)


def _label(goal: GoalRow) -> Text:
    """Return what the tree shows of a goal."""
    label = Text()
    label.append(one_line(goal.mode), _COLOURS.get(goal.mode, ""))
    if goal.outcome not in {"", "UNKNOWN"}:
        label.append(f" {one_line(goal.outcome)}", _COLOURS.get(goal.outcome, ""))
    label.append(one_line(f"  {goal.id} ({goal.goal_class})"))
    if goal.error:
        label.append(one_line(f"  {goal.error}"), "red")
    return label


def bar(progress: float, width: int) -> str:
    """Return how much is over as a bar of text.

    :param progress: between 0 and 1.
    """
    inner = max(1, width - 2)
    at = min(inner - 1, int(progress * inner))
    return "[" + "=" * at + "|" + "-" * (inner - 1 - at) + "]"


def plain(widget: Any) -> str:
    """Return the text that a widget shows."""
    return str(widget.render())
