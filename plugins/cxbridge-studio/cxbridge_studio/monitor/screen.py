"""The screen of ``cxbridge monitor``, an application of textual.

A second thread takes snapshots from the source and executes commands, since a daemon may be slow to reply,
and a recording slow to read. The thread and the screen exchange values through deques.
"""

from __future__ import annotations

import threading
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from typing import ClassVar, Final, TypeVar

from textual import events
from textual.app import App, ComposeResult
from textual.binding import BindingType
from textual.containers import Container, Vertical, VerticalScroll
from textual.css.query import NoMatches
from textual.widget import Widget
from textual.widgets import Footer, Input, Static, TabbedContent, TabPane

from cxbridge.errors import CxbridgeError
from cxbridge.history.outcome import LEGEND
from cxbridge.history.tree import goal_line
from cxbridge.numbers import parse_decimal
from cxbridge.printing import one_line, visible
from cxbridge_studio.monitor import live, recorded
from cxbridge_studio.monitor.keys import make_help_text
from cxbridge_studio.monitor.layout import (
    BREAKPOINT_SPECS,
    COLUMNS,
    LIVE_PANES,
    NARROW_COLUMNS,
    PANE_TITLES,
    RECORDED_PANES,
    STYLE,
    HelpScreen,
    make_key_bindings,
)
from cxbridge_studio.monitor.snapshot import MonitorSnapshot, MonitorSource, ViewQuery
from cxbridge_studio.monitor.widgets import (
    GoalTree,
    LogLines,
    RowTable,
    make_progress_bar,
)

_MAX_NOTE_LENGTH: Final = 2000  # limit of characters: a fact may be longer than the screen
_MESSAGE_S: Final = 5.0  # the time for which the message of a command is shown
_THREAD_END_S: Final = 1.0  # the time limit for the end of the thread
_MAX_SILENCE_S: Final = 2.0  # the time without a snapshot after which the screen reports the silence
_DELIVERY_PERIOD_S: Final = 0.03  # the time between two deliveries of the thread's results
_Widget = TypeVar("_Widget", bound=Widget)


class MonitorApp(App[None]):
    """Shows the state of a daemon or a recording, and sends commands to it.

    :param source: the daemon or the recording; only the second thread calls its methods.
    """

    CSS = STYLE
    TITLE = "cxbridge monitor"
    ENABLE_COMMAND_PALETTE = False
    # the smallest number of columns, and the class of the screen in a terminal of that width
    HORIZONTAL_BREAKPOINTS = [(0, "narrow"), (NARROW_COLUMNS, "wide")]  # noqa: RUF012 - as in the base class

    def __init__(self, source: MonitorSource) -> None:
        super().__init__()
        self._source = source
        self._source_kind = "live" if source.is_live else "recorded"
        self._panes = LIVE_PANES if source.is_live else RECORDED_PANES
        self._pending_commands: deque[str] = deque()
        self._results: deque[MonitorSnapshot | str] = deque(maxlen=1)  # the latest snapshot, or its error
        self._new_messages: deque[str] = deque()
        self._view_query = ViewQuery(pane=self._panes[0])
        self._wakeup = threading.Event()
        self._is_over = threading.Event()
        self._thread = threading.Thread(target=self._watch_source, name="monitor", daemon=True)
        self.snapshot = MonitorSnapshot("...")
        self._shown_texts: dict[str, str] = {}
        self._message = ""
        self._error = ""
        self._last_result_s = time.monotonic()
        # returns whether a signal has requested the end; called at each delivery
        self.is_end_requested: Callable[[], bool] = lambda: False

    def compose(self) -> ComposeResult:
        yield Static(one_line(f"{self._source.name}: ..."), id="status", markup=False)
        yield Static("", id="message", markup=False)
        with Container(id="main"):
            with Vertical(id="left"):
                yield GoalTree()
                yield Static(LEGEND, id="legend", markup=False)
            with TabbedContent(id="panes"):
                for number, name in enumerate(self._panes, 1):
                    with TabPane(f"{number} {PANE_TITLES.get(name, name.capitalize())}", id=f"pane-{name}"):
                        yield from self._make_pane_widgets(name)
        yield Input(id="prompt")
        yield Footer()

    def _make_pane_widgets(self, name: str) -> ComposeResult:
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
            yield RowTable("interfaces", columns)
            yield RowTable("fields", ("field", "value"))
        else:
            yield RowTable(name, COLUMNS[name])
        yield Static("", id=f"{name}-note", classes="note", markup=False)

    def on_mount(self) -> None:
        self._find_widget("#goals", GoalTree).root.expand()
        self._find_widget("#goals", GoalTree).focus()
        self.set_interval(_DELIVERY_PERIOD_S, self._deliver_results)
        self._thread.start()

    def on_unmount(self) -> None:
        """Stop the second thread, but do not wait long for a source that is slow to reply."""
        self._is_over.set()
        self._wakeup.set()
        self._thread.join(_THREAD_END_S)

    # -- in the second thread

    def _watch_source(self) -> None:
        while not self._is_over.is_set():
            try:
                while self._pending_commands:
                    message = self._execute_command(self._pending_commands.popleft())
                    self._new_messages += [message] if message else []
                self._results.append(self._source.take_snapshot(self._view_query))
            except CxbridgeError as error:
                self._results.append(error.message)
            except Exception as error:  # noqa: BLE001 - shown, since the screen would freeze without a reason
                self._results.append(f"an internal error of cxbridge: {type(error).__name__}: {error}")
            self._wakeup.wait(self._source.period_s)
            self._wakeup.clear()
        self._source.close()

    def _execute_command(self, command: str) -> str:
        try:
            return self._source.execute_command(command)
        except CxbridgeError as error:
            return f"{error.message}: {error.hint}" if error.hint else error.message

    # -- display

    def _deliver_results(self) -> None:
        """Show the latest results of the second thread."""
        if self.is_end_requested():
            self.exit()
        elif self.screen_stack:  # empty after the removal of the screen
            with suppress(NoMatches):  # during its removal, the screen lacks some widgets
                self._show_results()

    def _show_results(self) -> None:
        while self._new_messages:
            self._message = self._new_messages.popleft()
            self._show_message()
            self.set_timer(_MESSAGE_S, lambda message=self._message: self._clear_message(message))
        if self._results:
            result = self._results.popleft()
            self._last_result_s = time.monotonic()
            self._error = result if isinstance(result, str) else ""
            if isinstance(result, str):
                self._show_head(result)
            else:
                self.show(result)
        elif (silence_s := time.monotonic() - self._last_result_s) > _MAX_SILENCE_S:
            self._show_head(f"{self._error or 'no answer'}, for {silence_s:.0f} s")

    def show(self, snapshot: MonitorSnapshot) -> None:
        """Show a snapshot: the status line, the goals, and only the visible pane."""
        self.snapshot = snapshot
        filter_text, env = self._view_query.filter_text, self._view_query.env
        head_texts = (
            snapshot.head,
            f"{snapshot.omitted_goal_count} more goals" if snapshot.omitted_goal_count else "",
            f"filter: {filter_text}" if filter_text else "",
            f"environment: {env}" if env != "executive" else "",
        )
        self._show_head(" · ".join(filter(None, head_texts)))
        self._show_message()
        self._find_widget("#goals", GoalTree).show(snapshot.goals)
        pane = self._shown_pane
        if pane == "log":
            self._find_widget("#log", LogLines).show(snapshot.log)
            return
        if pane == "story":
            self._set_text("story-text", "\n".join(map(visible, snapshot.story)))
            return
        self._find_widget(f"#{pane}", RowTable).show(getattr(snapshot, pane))
        if pane == "interfaces":
            self._find_widget("#fields", RowTable).show(snapshot.fields)
        self._show_note(pane)

    def _set_text(self, name: str, text: str) -> None:
        """Set the text of a widget if it has changed: a new text makes textual compute the layout again."""
        if self._shown_texts.get(name) != text:
            self._shown_texts[name] = text
            self._find_widget(f"#{name}", Static).update(visible(text))

    def _find_widget(self, selector: str, widget_type: type[_Widget]) -> _Widget:
        """Return a widget of the main screen, which the help screen may cover."""
        return self.screen_stack[0].query_one(selector, widget_type)

    def _show_head(self, text: str) -> None:
        self._set_text("status", f"{self._source.name}: {text}")

    def _show_note(self, pane: str) -> None:
        """Show the full text of a pane's selected row and the note of its table below the table."""
        table_name = "fields" if pane == "interfaces" else pane
        selected_row = self._find_widget(f"#{table_name}", RowTable).item_at_cursor or ()
        notes = (
            " ".join(selected_row)[:_MAX_NOTE_LENGTH],
            getattr(self.snapshot, pane).note,
            self.snapshot.fields.note if pane == "interfaces" else "",
        )
        self._set_text(f"{pane}-note", "\n".join(filter(None, notes)))

    def _clear_message(self, message: str) -> None:
        """Clear a message, unless a later message has replaced it; the next snapshot replaces the text."""
        self._message = "" if self._message == message else self._message

    def _show_message(self) -> None:
        """Show the message of the last command, or else the stop of the snapshot, or else its notes.

        For a recording, a progress bar precedes the text.
        """
        snapshot = self.snapshot
        text = self._message or snapshot.stop or "; ".join(snapshot.notes)
        if snapshot.progress is not None:
            width = max(10, self.size.width // 4)
            text = f"{make_progress_bar(snapshot.progress, width)} {text}"
        self._set_text("message", text)

    @property
    def _shown_pane(self) -> str:
        return self._find_widget("#panes", TabbedContent).active.removeprefix("pane-")

    # -- selection: widgets send events also during the removal of the screen, when is_running is false

    def _change_query(self, **changes: str) -> None:
        """Change the query, and take a snapshot at once."""
        self._view_query = replace(self._view_query, **changes)
        self._wakeup.set()

    def on_tabbed_content_tab_activated(self, _event: TabbedContent.TabActivated) -> None:
        """Show the content of the pane."""
        if self.is_running:
            self._change_query(pane=self._shown_pane)
            self.show(self.snapshot)

    def on_data_table_row_highlighted(self, event: RowTable.RowHighlighted) -> None:
        """Show the values of the selected interface, or the full text of the selected row."""
        if not self.is_running:
            return
        table = event.data_table
        if isinstance(table, RowTable) and table.id == "interfaces" and table.item_at_cursor is not None:
            if table.item_at_cursor[0] != self._view_query.interface:
                self._change_query(interface=table.item_at_cursor[0])
        elif table.id in {self._shown_pane, "fields"}:
            self._show_note(self._shown_pane)

    def on_tree_node_highlighted(self) -> None:
        """Show the details of the selected goal, or the legend of icons."""
        if not self.is_running:
            return
        goal = self._find_widget("#goals", GoalTree).item_at_cursor
        text = LEGEND if goal is None else one_line(goal_line("", goal.id, goal, show_modes=True).text)
        self._set_text("legend", text)

    # -- keys

    def on_key(self, event: events.Key) -> None:
        """Show a pane by its number."""
        number = parse_decimal(event.key)
        if number is not None and 0 < number <= len(self._panes) and not self._is_typing:
            name = self._panes[number - 1]
            self._find_widget("#panes", TabbedContent).active = f"pane-{name}"
            self._find_widget(f"#{name}", Widget).focus()
            event.stop()

    @property
    def _is_typing(self) -> bool:
        return isinstance(self.focused, Input)

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:  # noqa: ARG002 - as in the base class
        """Return whether an action is enabled: while a user types, keys of commands belong to the prompt."""
        return not (action == "do" and self._is_typing)

    def action_do(self, command: str) -> None:
        """Queue a command for the second thread."""
        self._message = ""
        self._pending_commands.append(command)
        self._wakeup.set()

    def action_help(self) -> None:
        commands = live.COMMANDS_HELP if self._source.is_live else recorded.COMMANDS_HELP
        self.push_screen(HelpScreen(make_help_text(self._source_kind, ", ".join(self._panes), commands)))

    def action_next_environment(self) -> None:
        names, env = list(self.snapshot.environments), self._view_query.env
        if names:
            index = names.index(env) if env in names else -1
            self._change_query(env=names[(index + 1) % len(names)])

    def action_breakpoint(self) -> None:
        """Open the prompt for a breakpoint at the selection."""
        spec, pane, goals = "", self._shown_pane, self._find_widget("#goals", GoalTree)
        if goals.has_focus:
            spec = "" if goals.item_at_cursor is None else f"goal:{goals.item_at_cursor.goal_class}:"
        elif (
            pane in BREAKPOINT_SPECS
            and (row := self._find_widget(f"#{pane}", RowTable).item_at_cursor) is not None
        ):
            kind, name_column, suffix = BREAKPOINT_SPECS[pane]
            spec = f"{kind}:{row[name_column]}{suffix}"
        self.action_ask(f":break {spec}")

    def action_delete(self) -> None:
        """Remove the selected breakpoint."""
        row = self._find_widget("#breakpoints", RowTable).item_at_cursor
        if self._shown_pane == "breakpoints" and row is not None:
            self.action_do(f"delete {row[0]}")

    # -- prompt

    def action_ask(self, request: str) -> None:
        """Open the prompt.

        :param request: ``/`` for a filter, or ``:`` and the first words of a command.
        """
        prompt = self._find_widget("#prompt", Input)
        prompt.placeholder = "filter: part of an id, a mode, a name" if request == "/" else "command"
        prompt.set_class(request == "/", "filter")
        with prompt.prevent(Input.Changed):  # the user has typed nothing, so the filter stays
            prompt.value = self._view_query.filter_text if request == "/" else request[1:]
        prompt.cursor_position = len(prompt.value)
        prompt.select_on_focus = False  # typed characters continue the text instead of replacing it
        prompt.add_class("shown")
        prompt.focus()

    def action_dismiss(self) -> None:
        """Close the prompt; if it has no command, also clear the filter."""
        is_for_command = self._is_typing and not self._find_widget("#prompt", Input).has_class("filter")
        self._leave_prompt()
        if not is_for_command:
            self._change_query(filter_text="")
            self._message = ""

    def _leave_prompt(self) -> None:
        self._find_widget("#prompt", Input).remove_class("shown")
        if self._is_typing:
            self._find_widget(f"#{self._shown_pane}", Widget).focus()

    def on_input_changed(self, event: Input.Changed) -> None:
        """Apply the filter while typing."""
        if event.input.has_class("filter") and event.input.has_class("shown"):
            self._change_query(filter_text=event.value.strip().lower())

    def on_input_submitted(self, event: Input.Submitted) -> None:
        """Execute the command, or keep the filter."""
        if not event.input.has_class("filter") and event.value.strip():
            self.action_do(event.value.strip())
        self._leave_prompt()


# two classes, since textual reads the key bindings from the class
class LiveApp(MonitorApp):
    BINDINGS: ClassVar[list[BindingType]] = make_key_bindings("live")


class RecordedApp(MonitorApp):
    BINDINGS: ClassVar[list[BindingType]] = make_key_bindings("recorded")


def make_monitor_app(source: MonitorSource) -> MonitorApp:
    return (LiveApp if source.is_live else RecordedApp)(source)
