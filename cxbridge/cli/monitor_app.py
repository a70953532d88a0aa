"""The screen of ``cxbridge monitor``."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Sequence
from typing import Any, ClassVar, Final, Protocol

from rich.text import Text
from textual.app import App, ComposeResult
from textual.binding import Binding, BindingType
from textual.containers import Horizontal
from textual.widgets import DataTable, Footer, Input, RichLog, Static, TabbedContent, TabPane, Tree
from textual.widgets.tree import TreeNode

from cxbridge.errors import CxbridgeError

PERIOD_S: Final = 0.3
"""Seconds between two looks."""

_DELIVERY_S: Final = 0.05

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
_LEVELS: Final = {"D": "dim", "I": "", "W": "yellow", "E": "red"}


class Source(Protocol):
    """What is watched; called by one thread."""

    def look(self, since: int) -> dict[str, Any]:
        """Return how it stands, with log lines after number ``since``."""

    def do(self, what: str) -> None:
        """Carry out ``pause``, ``resume``, ``rule``, ``loop`` or ``transition``."""


class MonitorApp(App[None]):
    """Shows how a daemon stands, and tells it what to do.

    :param where: its URL, for the title.
    """

    CSS = """
    #status { height: 1; background: $primary; color: $text; padding: 0 1; }
    #goals { width: 50%; border-right: solid $primary; }
    #filter { display: none; }
    #filter.shown { display: block; }
    """
    TITLE = "cxbridge monitor"
    ENABLE_COMMAND_PALETTE = False
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("p", "do('pause')", "Pause"),
        Binding("r", "do('resume')", "Resume"),
        Binding("s", "do('rule')", "Step rule"),
        Binding("l", "do('loop')", "Step loop"),
        Binding("t", "do('transition')", "Step transition"),
        Binding("slash", "filter", "Filter", key_display="/"),
        Binding("escape", "no_filter", "All", show=False),
        Binding("q", "quit", "Quit"),
    ]

    def __init__(self, source: Source, where: str) -> None:
        super().__init__()
        self._source = source
        self._where = where
        self._todo: deque[str] = deque()
        self._news: deque[dict[str, Any] | str] = deque()
        self._wake = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="monitor", daemon=True)
        self._goal_nodes: dict[str, TreeNode[str]] = {}
        self._structure: list[tuple[str, str]] | None = None
        self._rows: dict[str, list[tuple[str, ...]]] = {}
        self._last_line = 0
        self._words = ""
        self._seen: dict[str, Any] | None = None

    def compose(self) -> ComposeResult:
        """Make the screen."""
        yield Static(f"{self._where}: ...", id="status", markup=False)
        with Horizontal():
            yield Tree("goals", id="goals")
            with TabbedContent():
                for title in ("Actions", "Skills", "Interfaces"):
                    with TabPane(title, id=f"pane-{title.lower()}"):
                        yield DataTable(id=title.lower(), cursor_type="row")
                with TabPane("Log", id="pane-log"):
                    yield RichLog(id="log", wrap=True, max_lines=2000)
        yield Input(placeholder="filter: part of an id, a class, a mode, a name", id="filter")
        yield Footer()

    def on_mount(self) -> None:
        """Begin to watch."""
        self.query_one("#goals", Tree).root.expand()
        for name, columns in (
            ("actions", ("goal", "id", "action", "arguments", "state")),
            ("skills", ("skiller", "skill", "status")),
            ("interfaces", ("interface", "writer", "readers")),
        ):
            self.query_one(f"#{name}", DataTable).add_columns(*columns)
        self.query_one("#goals").focus()
        self.set_interval(_DELIVERY_S, self._deliver)
        self._thread.start()

    def on_unmount(self) -> None:
        """Watch no more."""
        self._over.set()
        self._wake.set()

    # -- in the thread that watches

    def _watch(self) -> None:
        while not self._over.is_set():
            try:
                while self._todo:
                    self._source.do(self._todo.popleft())
                seen = self._source.look(self._last_line)
            except CxbridgeError as error:
                self._news.append(error.message)
            else:
                self._news.append(seen)
            self._wake.wait(PERIOD_S)
            self._wake.clear()

    # -- what is shown

    def _deliver(self) -> None:
        """Show what the thread has seen."""
        while self._news:
            seen = self._news.popleft()
            if isinstance(seen, str):
                self.query_one("#status", Static).update(f"{self._where}: {seen}")
            else:
                self.show(seen)

    def show(self, seen: dict[str, Any]) -> None:
        """Show how it stands."""
        self._seen = seen
        status, where, state = seen["status"], seen["where"], seen["state"]
        stop = f", rules stopped {where['reason']}" if where else ""
        more = f", {state['more_goals']} more goals" if state["more_goals"] else ""
        filtered = f", filter: {self._words}" if self._words else ""
        self.query_one("#status", Static).update(
            f"{self._where}: {status['state'].lower()}{stop}{more}{filtered}"
        )
        self._show_goals(state["goals"])
        self._show_rows("actions", [(row[0], *row[2:]) for row in state["actions"]])
        self._show_rows("skills", [tuple(row) for row in state["skills"]])
        self._show_rows("interfaces", [tuple(row) for row in seen["interfaces"]])
        log = self.query_one("#log", RichLog)
        for number, level, component, text in state["log"]:
            if number > self._last_line:
                log.write(Text(f"{level} {component}: {text}", style=_LEVELS.get(level, "")))
                self._last_line = number

    def _show_goals(self, goals: Sequence[Sequence[str]]) -> None:
        """Bring the tree up to date; it is built anew only when goals come, go or move."""
        by_id = {goal[0]: goal for goal in goals}
        wanted = self._wanted(by_id)
        structure = [(goal, by_id[goal][2]) for goal in by_id if goal in wanted]
        if structure != self._structure:
            self._structure = structure
            self._build(by_id, structure)
        for goal, _ in structure:
            row, node = by_id[goal], self._goal_nodes[goal]
            label = _label(row)
            if node.label != label:
                node.set_label(label)

    def _build(self, by_id: dict[str, Sequence[str]], structure: list[tuple[str, str]]) -> None:
        tree: Tree[str] = self.query_one("#goals", Tree)
        at = tree.cursor_node.data if tree.cursor_node is not None else None
        tree.clear()
        self._goal_nodes = {}
        below: dict[str, list[str]] = {}
        for goal, parent in structure:
            below.setdefault(parent if parent in by_id else "", []).append(goal)
        waiting = [(goal, tree.root) for goal in reversed(below.get("", ()))]
        while waiting:
            goal, over = waiting.pop()
            leaf = goal not in below
            add = over.add_leaf if leaf else over.add
            node = add(_label(by_id[goal]), data=goal)
            if not leaf:
                node.expand()
                waiting += [(child, node) for child in reversed(below.pop(goal))]
            self._goal_nodes[goal] = node
        for goal, _ in structure:
            if goal not in self._goal_nodes:  # a circle of parents
                self._goal_nodes[goal] = tree.root.add_leaf(_label(by_id[goal]), data=goal)
        tree.root.expand()
        if at in self._goal_nodes:
            tree.call_after_refresh(tree.move_cursor, self._goal_nodes[at])

    def _wanted(self, by_id: dict[str, Sequence[str]]) -> set[str]:
        """Return the goals that pass the filter, with all above them."""
        wanted: set[str] = set()
        for goal, row in by_id.items():
            at = goal if self._passes(row) else ""
            while at in by_id and at not in wanted:
                wanted.add(at)
                at = by_id[at][2]
        return wanted

    def _show_rows(self, name: str, rows: list[tuple[str, ...]]) -> None:
        """Fill a table, if it has other rows than before."""
        rows = [row for row in rows if self._passes(row)]
        if self._rows.get(name) == rows:
            return
        self._rows[name] = rows
        table = self.query_one(f"#{name}", DataTable)
        at = table.cursor_row
        table.clear()
        for row in rows:
            table.add_row(*(Text(cell, style=_COLOURS.get(cell, "")) for cell in row))
        table.move_cursor(row=min(at, len(rows) - 1))

    def _passes(self, row: Sequence[str]) -> bool:
        return self._words in " ".join(row).lower()

    # -- what is typed

    def action_do(self, what: str) -> None:
        """Have it done by the thread that watches."""
        self._todo.append(what)
        self._wake.set()

    def action_filter(self) -> None:
        """Ask for a filter."""
        field = self.query_one("#filter", Input)
        field.add_class("shown")
        field.focus()

    def action_no_filter(self) -> None:
        """Show everything again."""
        field = self.query_one("#filter", Input)
        field.value = ""
        field.remove_class("shown")
        self._refilter("")

    def on_input_changed(self, event: Input.Changed) -> None:
        """Filter while it is typed."""
        self._refilter(event.value)

    def on_input_submitted(self, _event: Input.Submitted) -> None:
        """Keep the filter, and go back to the goals."""
        self.query_one("#filter", Input).remove_class("shown")
        self.query_one("#goals").focus()

    def _refilter(self, words: str) -> None:
        self._words = words.strip().lower()
        if self._seen is not None:
            self.show(self._seen)


def _label(goal: Sequence[str]) -> Text:
    """Return what the tree shows of a goal."""
    name, goal_class, _, mode, outcome, error = goal
    label = Text()
    label.append(mode, _COLOURS.get(mode, ""))
    if outcome not in {"", "UNKNOWN"}:
        label.append(f" {outcome}", _COLOURS.get(outcome, ""))
    label.append(f"  {name} ({goal_class})")
    if error:
        label.append(f"  {error}", "red")
    return label
