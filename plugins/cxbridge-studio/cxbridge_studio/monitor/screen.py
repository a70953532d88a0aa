"""The screen of ``cxbridge monitor``."""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from typing import ClassVar, Final, TypeVar

from textual import events
from textual.app import App, ComposeResult
from textual.binding import BindingType
from textual.containers import Container, Vertical, VerticalScroll
from textual.css.query import NoMatches
from textual.widget import Widget
from textual.widgets import Input, Static, TabbedContent, TabPane

from cxbridge.errors import CxbridgeError
from cxbridge.history.outcome import LEGEND
from cxbridge.history.tree import goal_line
from cxbridge.printing import one_line, visible
from cxbridge_studio.monitor import live, recorded
from cxbridge_studio.monitor.keys import help_text
from cxbridge_studio.monitor.layout import (
    BREAK_AT,
    COLUMNS,
    LIVE_PANES,
    LOW,
    NARROW,
    RECORDED_PANES,
    STYLE,
    TITLES,
    WIDE,
    HelpScreen,
    key_bindings,
)
from cxbridge_studio.monitor.snapshot import MonitorSnapshot, MonitorSource, ViewQuery
from cxbridge_studio.monitor.widgets import Aside, GoalTree, KeyLine, LogLines, Rows, bar

_LONGEST: Final = 2000  # characters of a note
_SAID_S: Final = 5.0  # seconds for which an answer is shown
_PATIENCE_S: Final = 1.0  # seconds for the reading thread to end
_SILENCE_S: Final = 2.0  # seconds without an answer after which the screen says so
_DELIVERY_S: Final = 0.03  # seconds between two looks at the thread's results
_Widget = TypeVar("_Widget", bound=Widget)


class MonitorApp(App[None]):
    """Shows the state of a daemon or a recording and sends commands to it.

    :param source: called from a second thread only.
    """

    CSS = STYLE
    TITLE = "cxbridge monitor"
    ENABLE_COMMAND_PALETTE = False

    def __init__(self, source: MonitorSource) -> None:
        super().__init__()
        self._source = source
        self._where = "live" if source.is_live else "recorded"
        self._panes = LIVE_PANES if source.is_live else RECORDED_PANES
        self._todo: deque[str] = deque()
        self._seen: deque[MonitorSnapshot | str] = deque(maxlen=1)
        self._notices: deque[str] = deque()
        self._view_query = ViewQuery(pane=self._panes[0])
        self._wake = threading.Event()
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="monitor", daemon=True)
        self.snapshot = MonitorSnapshot("...")
        self._texts: dict[str, str] = {}
        self._said = ""
        self._trouble = ""
        self._seen_s = time.monotonic()
        # Returns whether a signal has requested the end; called at each look.
        self.is_end_requested: Callable[[], bool] = lambda: False

    def compose(self) -> ComposeResult:
        yield Static(one_line(f"{self._source.name}: ..."), id="status", markup=False)
        yield Static("", id="said", markup=False)
        with Container(id="main"):
            with Vertical(id="left"):
                yield GoalTree()
                yield Static(LEGEND, id="legend", markup=False)
            with TabbedContent(id="panes"):
                for number, name in enumerate(self._panes, 1):
                    with TabPane(f"{number} {TITLES.get(name, name.capitalize())}", id=f"pane-{name}"):
                        yield from self._pane(name)
            yield Aside()
        yield Input(id="prompt")
        yield KeyLine()

    def _pane(self, name: str) -> ComposeResult:
        if name == "log":
            yield LogLines()
            return
        if name == "story":
            with VerticalScroll(id="story"):
                yield Static("", id="story-text", markup=False)
            return
        if name == "interfaces":
            columns = (
                ("interface", "writer", "readers") if self._source.is_live else ("interface", "written", "")
            )
            yield Rows("interfaces", columns)
            yield Rows("fields", ("field", "value"))
        else:
            yield Rows(name, COLUMNS[name])
        yield Static("", id=f"{name}-note", classes="note", markup=False)

    def on_mount(self) -> None:
        self._find("#goals", GoalTree).root.expand()
        self._find("#goals", GoalTree).focus()
        self.set_interval(_DELIVERY_S, self._deliver)
        self._thread.start()

    def on_resize(self, event: events.Resize) -> None:
        """Arrange goals and panes for the width and height of the terminal."""
        self.screen.set_class(event.size.width < NARROW, "narrow")
        self.screen.set_class(event.size.width >= WIDE, "wide")
        self.screen.set_class(event.size.height < LOW, "low")

    def on_unmount(self) -> None:
        """Stop the watching thread, without waiting for a source that is slow to reply."""
        self._over.set()
        self._wake.set()
        self._thread.join(_PATIENCE_S)

    # -- in the watching thread

    def _watch(self) -> None:
        while not self._over.is_set():
            try:
                while self._todo:
                    answer_text = self._do(self._todo.popleft())
                    if answer_text:
                        self._notices.append(answer_text)
                self._seen.append(self._source.look(self._view_query))
            except CxbridgeError as error:
                self._seen.append(error.message)
            except Exception as error:  # noqa: BLE001 - shown, since a frozen screen explains nothing
                self._seen.append(f"a fault of cxbridge: {type(error).__name__}: {error}")
            self._wake.wait(self._source.period_s)
            self._wake.clear()
        self._source.close()

    def _do(self, command: str) -> str:
        try:
            return self._source.do(command, self._view_query)
        except CxbridgeError as error:
            return f"{error.message}: {error.hint}" if error.hint else error.message

    # -- display

    def _deliver(self) -> None:
        """Show the latest snapshot of the watching thread."""
        if self.is_end_requested():
            self.exit()
        elif self.screen_stack:  # else the screen is already removed,
            with suppress(NoMatches):  # or is being removed
                self._show_news()

    def _show_news(self) -> None:
        while self._notices:
            self._said = self._notices.popleft()
            self._show_said()
            self.set_timer(_SAID_S, self._forget_said)
        if self._seen:
            seen = self._seen.popleft()
            self._seen_s = time.monotonic()
            if isinstance(seen, str):
                self._trouble = seen
                self._show_head(seen)
            else:
                self._trouble = ""
                self.show(seen)
        elif (silence_s := time.monotonic() - self._seen_s) > _SILENCE_S:
            self._show_head(f"{self._trouble or 'no answer'}, for {silence_s:.0f} s")

    def show(self, snapshot: MonitorSnapshot) -> None:
        self.snapshot = snapshot
        words = [snapshot.head]
        if snapshot.more_goals:
            words.append(f"{snapshot.more_goals} more goals")
        if self._view_query.words:
            words.append(f"filter: {self._view_query.words}")
        if self._view_query.env != "executive":
            words.append(f"environment: {self._view_query.env}")
        self._show_head(" · ".join(words))
        self._show_said()
        self._find("#goals", GoalTree).show(snapshot.goals)
        self._find("#aside", Aside).show(snapshot)
        pane = self._pane_shown
        if pane == "log":
            self._find("#log", LogLines).show(snapshot.log)
            return
        if pane == "story":
            self._write("story-text", "\n".join(map(visible, snapshot.story)))
            return
        table = getattr(snapshot, pane)
        rows = self._find(f"#{pane}", Rows)
        rows.show(table)
        if pane == "interfaces":
            self._find("#fields", Rows).show(snapshot.fields)
        self._show_note(pane)

    def _write(self, name: str, text: str) -> None:
        """Set the text of a line; unchanged text causes no layout."""
        if self._texts.get(name) != text:
            self._texts[name] = text
            self._find(f"#{name}", Static).update(visible(text))

    def _find(self, selector: str, kind: type[_Widget]) -> _Widget:
        """Return a widget of the main screen, which may be below the list of keys."""
        return self.screen_stack[0].query_one(selector, kind)

    def _show_head(self, text: str) -> None:
        self._write("status", f"{self._source.name}: {text}")

    def _show_note(self, pane: str) -> None:
        """Show the note below a pane, and the full text of the selected fact."""
        table = getattr(self.snapshot, pane)
        notes = [table.note, self.snapshot.fields.note if pane == "interfaces" else ""]
        chosen = self._find("#fields" if pane == "interfaces" else f"#{pane}", Rows).chosen
        notes.insert(0, " ".join(chosen)[:_LONGEST] if chosen else "")
        self._write(f"{pane}-note", "\n".join(filter(None, notes)))

    def _forget_said(self) -> None:
        self._said = ""  # the next look clears it

    def _show_said(self) -> None:
        """Show the last message, or the stop of the rules, or the position in a recording."""
        snapshot = self.snapshot
        text = self._said or snapshot.stop or "; ".join(snapshot.notes)
        if snapshot.progress is not None:
            width = max(10, self.size.width // 4)
            text = f"{bar(snapshot.progress, width)} {text}"
        self._write("said", text)

    @property
    def _pane_shown(self) -> str:
        return self._find("#panes", TabbedContent).active.removeprefix("pane-")

    # -- selection; widgets still send events while the screen is being removed: is_running is false then

    def _want(self, **changes: str) -> None:
        """Change the query and look at once."""
        query = self._view_query
        self._view_query = ViewQuery(
            changes.get("pane", query.pane),
            changes.get("interface", query.interface),
            changes.get("env", query.env),
            changes.get("words", query.words),
        )
        self._wake.set()

    def on_tabbed_content_tab_activated(self, _event: TabbedContent.TabActivated) -> None:
        """Show the content of the pane."""
        if self.is_running:
            self._want(pane=self._pane_shown)
            self.show(self.snapshot)

    def on_data_table_row_highlighted(self, event: Rows.RowHighlighted) -> None:
        """Show the values of the selected interface, or the full text of the selected fact."""
        if not self.is_running:
            return
        table = event.data_table
        if isinstance(table, Rows) and table.id == "interfaces" and table.chosen is not None:
            if table.chosen[0] != self._view_query.interface:
                self._want(interface=table.chosen[0])
        elif table.id in {self._pane_shown, "fields"}:
            self._show_note(self._pane_shown)

    def on_tree_node_highlighted(self) -> None:
        """Show the details of the selected goal, or the legend of icons."""
        if not self.is_running:
            return
        goal = self._find("#goals", GoalTree).chosen
        self._write(
            "legend", LEGEND if goal is None else one_line(goal_line("", goal.id, goal, modes=True).text)
        )

    # -- keys

    def on_key(self, event: events.Key) -> None:
        """Show a pane by its number."""
        if event.key.isdecimal() and 0 < int(event.key) <= len(self._panes) and not self._is_typing:
            name = self._panes[int(event.key) - 1]
            self._find("#panes", TabbedContent).active = f"pane-{name}"
            self._find(f"#{name}", Widget).focus()
            event.stop()

    @property
    def _is_typing(self) -> bool:
        return isinstance(self.focused, Input)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002
        """Leave the scrubbing keys to the prompt while it has the focus."""
        return not (action == "do" and self._is_typing)

    def action_do(self, command: str) -> None:
        """Queue a command for the watching thread."""
        self._said = ""
        self._todo.append(command)
        self._wake.set()

    def action_help(self) -> None:
        commands = live.HELP if self._source.is_live else recorded.HELP
        self.push_screen(HelpScreen(help_text(self._where, ", ".join(self._panes), commands)))

    def action_next_environment(self) -> None:
        names = list(self.snapshot.environments)
        if names:
            at = names.index(self._view_query.env) if self._view_query.env in names else -1
            self._want(env=names[(at + 1) % len(names)])

    def action_breakpoint(self) -> None:
        """Open the prompt for a breakpoint at the selection."""
        spec, pane, goals = "", self._pane_shown, self._find("#goals", GoalTree)
        if goals.has_focus:
            spec = "" if goals.chosen is None else f"goal:{goals.chosen.goal_class}:"
        elif pane in BREAK_AT and (row := self._find(f"#{pane}", Rows).chosen) is not None:
            begin, column, end = BREAK_AT[pane]
            spec = f"{begin}:{row[column]}{end}"
        self.action_ask(f":break {spec}")

    def action_delete(self) -> None:
        """Remove the selected breakpoint, or open the prompt to retract the selected fact."""
        if self._pane_shown == "breakpoints" and (row := self._find("#breakpoints", Rows).chosen):
            self.action_do(f"delete {row[0]}")
        elif self._pane_shown == "facts" and (row := self._find("#facts", Rows).chosen):
            self.action_ask(f":retract {row[0]}")

    def action_edit(self) -> None:
        """Open the prompt to modify the selected fact."""
        if self._pane_shown == "facts" and (row := self._find("#facts", Rows).chosen):
            self.action_ask(f":modify {row[0]} (")

    # -- prompt

    def action_ask(self, begin: str) -> None:
        """Open the prompt, for a filter (``/``) or a command (``:`` and its first words)."""
        prompt = self._find("#prompt", Input)
        prompt.placeholder = "filter: part of an id, a mode, a name" if begin == "/" else "command"
        prompt.set_class(begin == "/", "filter")
        with prompt.prevent(Input.Changed):
            prompt.value = self._view_query.words if begin == "/" else begin[1:]
        prompt.cursor_position = len(prompt.value)
        prompt.select_on_focus = False
        prompt.add_class("shown")
        prompt.focus()

    def action_dismiss(self) -> None:
        """Close the prompt; if it has no command, also clear the filter."""
        was_command = self._is_typing and not self._find("#prompt", Input).has_class("filter")
        self._leave_prompt()
        if not was_command:
            self._want(words="")
            self._said = ""

    def _leave_prompt(self) -> None:
        self._find("#prompt", Input).remove_class("shown")
        if self._is_typing:
            self._focus_pane()

    def _focus_pane(self) -> None:
        name = self._pane_shown
        self._find(f"#{name}", Widget).focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Apply the filter while typing."""
        if event.input.has_class("filter") and event.input.has_class("shown"):
            self._want(words=event.value.strip().lower())

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Carry out the command, or keep the filter."""
        if not event.input.has_class("filter") and event.value.strip():
            self.action_do(event.value.strip())
        self._leave_prompt()


class LiveApp(MonitorApp):
    BINDINGS: ClassVar[list[BindingType]] = key_bindings("live")


class RecordedApp(MonitorApp):
    BINDINGS: ClassVar[list[BindingType]] = key_bindings("recorded")


def monitor_app(source: MonitorSource) -> MonitorApp:
    return (LiveApp if source.is_live else RecordedApp)(source)
