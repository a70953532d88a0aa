"""The source of the monitor for a daemon: requests its state over the blackboard, and sends commands.

A request takes time in the daemon's loop. Therefore expensive data are requested only for the shown pane, in
pieces, and with pauses.
"""

from __future__ import annotations

import time
from collections import deque
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Final

from cxbridge.blackboard import parse_uid
from cxbridge.blackboard.errors import UnknownTypeError, VersionMismatchError
from cxbridge.clock import MICROSECONDS
from cxbridge.daemon.client import NoAnswerError, ask_why, read_status, request, send_command
from cxbridge.errors import BlackBoardError, CxbridgeError, InterfaceError
from cxbridge.interfaces.assignments import field_text
from cxbridge_studio.debugger.command_words import execute_command, parse_number
from cxbridge_studio.monitor.filtering import format_duration, make_filtered_table
from cxbridge_studio.monitor.snapshot import (
    MAX_LINES,
    MAX_ROWS,
    GoalRow,
    LogRow,
    MonitorSnapshot,
    Table,
    ViewQuery,
)

if TYPE_CHECKING:
    from cxbridge.blackboard import BlackBoard
    from cxbridge.interfaces.instance import Interface

REPLY_TIMEOUT_S: Final = 5.0  # many loops of a daemon, which processes one request per loop

MAX_GOALS: Final = 1000  # limit of the requested goals, halved after a reply that is too long

_MIN_GOALS: Final = 50  # with fewer goals, a reply is too long for another reason
_RATE_SNAPSHOTS: Final = 20  # the number of snapshots over which the loop rate is averaged
_SEARCH_SLICE_S: Final = 0.25  # the time that a snapshot spends on the search of facts
# the pause between two searches, as a multiple of the last search's duration: at most a sixth of the time is
# spent on searches
_PAUSE_FACTOR: Final = 5.0
_MIN_PAUSE_S: Final = 1.0  # the shortest pause between two searches
_STORY_PERIOD_S: Final = 2.0  # the time between two requests for the explanation of the run

_ACTION_SLOTS: Final = ("goal-id", "id", "action-name", "param-values", "state")

OWNER: Final = "cxbridge monitor"
_EMPTY_STATE: Final[Mapping[str, Any]] = {
    "goals": [],
    "more_goals": 0,
    "actions": [],
    "skills": [],
    "log": [],
    "where": None,
    "breakpoints": [],
    "environments": [],
}

COMMANDS_HELP: Final = "pause, resume, reset, step rule|loop|transition, break SPEC, delete NUMBER..."


class DaemonSource:
    """A watched daemon. After a lost connection, each snapshot tries to connect again.

    :param name: the daemon's URL.
    :param connect: opens the daemon's blackboard.
    """

    is_live = True
    period_s = 0.3

    def __init__(self, name: str, connect: Callable[[], BlackBoard]) -> None:
        self.name = name
        self._connect = connect
        self._board: BlackBoard | None = None
        self._shown_interface: Interface | None = None  # the interface whose fields are shown
        self._log: deque[LogRow] = deque(maxlen=MAX_LINES)
        self._last_line_number = 0  # of the last log line that a reply contained
        self._started_us: int | None = None  # the start of the daemon; None before the first snapshot
        self._max_goals = MAX_GOALS
        self._search = _FactSearch()
        self._last_story: Sequence[str] = ()
        self._next_story_s = 0.0
        # The time in seconds and the number of loops at each of the last snapshots.
        self._loop_counts: deque[tuple[float, int]] = deque(maxlen=_RATE_SNAPSHOTS)
        self._commands: dict[str, Callable[[str], str]] = {
            "pause": lambda _: self._send_command("Pause"),
            "resume": lambda _: self._send_command("Resume"),
            "reset": lambda _: self._send_command("Reset"),
            "step": lambda unit: self._request("step", what=unit or "rule") or "",
            "break": self._add_breakpoint,
            "delete": lambda numbers: self._request("break-remove", numbers=_parse_numbers(numbers)) or "",
        }

    def close(self) -> None:
        self._close_shown_interface()
        board, self._board = self._board, None
        if board is not None:
            with suppress(CxbridgeError):
                board.shutdown()

    # -- reading

    def take_snapshot(self, query: ViewQuery) -> MonitorSnapshot:
        """Return the state of the daemon.

        :raises CxbridgeError: if the daemon cannot be reached, or the server is not a daemon.
        """
        try:
            return self._make_snapshot(self._connect_board(), query)
        except CxbridgeError:
            self.close()  # the next snapshot connects again
            raise

    def _connect_board(self) -> BlackBoard:
        if self._board is None:
            self._board = self._connect()
        if not self._board.connected:
            raise BlackBoardError("the daemon is gone")
        return self._board

    def _make_snapshot(self, board: BlackBoard, query: ViewQuery) -> MonitorSnapshot:
        status = read_status(board)
        if status["started_us"] != self._started_us:  # a restarted daemon numbers its log lines from 1 again
            self._started_us, self._last_line_number, self._search = status["started_us"], 0, _FactSearch()
            self._log.clear()
            self._loop_counts.clear()
        problem = ""
        try:
            state = self._request_state(query.filter_text)
        except BlackBoardError as error:  # the daemon is ending; its blackboard is still shown
            state, problem = _EMPTY_STATE, error.message
        for number, level, component, text in state["log"]:
            self._log.append(LogRow(number, level, f"{level} {component}: {text}"))
            self._last_line_number = number
        stop = state["where"]
        head = (status["state"].lower(), *self._describe_times(status, state), problem, status["error"])
        return MonitorSnapshot(
            head=" · ".join(filter(None, head)),
            stop="" if stop is None else describe_stop(stop),
            goals=[_make_goal_row(**row) for row in state["goals"]],
            omitted_goal_count=state["more_goals"],
            actions=make_filtered_table(
                (tuple(row[slot] for slot in _ACTION_SLOTS) for row in state["actions"]),
                query.filter_text,
                "plan-actions",
            ),
            skills=make_filtered_table(
                (tuple(row) for row in state["skills"]), query.filter_text, "Skillers"
            ),
            interfaces=make_filtered_table(
                (
                    (
                        f"{interface.type}::{interface.id}",
                        interface.writer if interface.has_writer else "-",
                        str(interface.num_readers),
                    )
                    for interface in sorted(board.list_all(), key=lambda interface: interface.uid)
                ),
                query.filter_text,
                "interfaces",
            ),
            fields=self._read_fields(board, query),
            facts=_read_table_or_note(self._find_facts, query)
            if query.pane == "facts" and not problem
            else Table(),
            agenda=_read_table_or_note(self._read_agenda, query)
            if query.pane == "agenda" and not problem
            else Table(),
            breakpoints=Table([(str(row["number"]), row["spec"]) for row in state["breakpoints"]]),
            log=tuple(self._log),
            story=self._refresh_story(board) if query.pane == "story" and not problem else (),
            environments=state["environments"],
        )

    def _describe_times(self, status: Mapping[str, Any], state: Mapping[str, Any]) -> Iterator[str]:
        """Yield the time since the daemon's start, and the number and rate of its loops, as texts."""
        if "time_us" not in state:  # an ending daemon has not replied
            return
        clock_name = status["clock"]
        seconds = (state["time_us"] - status["started_us"]) / MICROSECONDS
        yield f"up {format_duration(seconds)}" + (f" ({clock_name} clock)" if clock_name != "real" else "")
        loops = state.get("loops", 0)
        self._loop_counts.append((time.monotonic(), loops))
        (first_s, first_count), (last_s, last_count) = self._loop_counts[0], self._loop_counts[-1]
        rate = f" at {(last_count - first_count) / (last_s - first_s):.0f} Hz" if last_s > first_s else ""
        yield f"loop {loops:,}{rate}"

    def _refresh_story(self, board: BlackBoard) -> Sequence[str]:
        """Return the lines of the daemon's explanation of the run, or the reason why there is none.

        The explanation may be :data:`_STORY_PERIOD_S` old, and older if the daemon replies too late.
        """
        now_s = time.monotonic()
        if now_s >= self._next_story_s:
            self._next_story_s = now_s + _STORY_PERIOD_S
            try:
                explanation = ask_why(board, "", "run", 0, REPLY_TIMEOUT_S)
            except CxbridgeError as error:
                self._last_story = (error.message, error.hint or "")
            else:
                self._last_story = self._last_story if explanation is None else explanation["lines"]
        return self._last_story

    def _request(self, verb: str, **arguments: Any) -> Any:
        return request(self._connect_board(), verb, REPLY_TIMEOUT_S, **arguments)

    def _request_state(self, filter_text: str) -> Mapping[str, Any]:
        """Return the daemon's report, with fewer goals if the reply would be too long."""
        while True:
            try:
                state: Mapping[str, Any] = self._request(
                    "state", since=self._last_line_number, goals=self._max_goals, words=filter_text
                )
            except CxbridgeError as error:
                # a reply is a field of RequestInterface, whose length is fixed
                if "too long" not in error.message or self._max_goals <= _MIN_GOALS:
                    raise
                self._max_goals //= 2
            else:
                return state

    def _read_fields(self, board: BlackBoard, query: ViewQuery) -> Table:
        if not query.interface or query.pane != "interfaces":
            self._close_shown_interface()
            return Table()
        if (
            self._shown_interface is None
            or self._shown_interface.uid != query.interface
            or not self._shown_interface.valid
        ):
            self._close_shown_interface()
            try:
                self._shown_interface = board.open_for_reading(*parse_uid(query.interface), owner=OWNER)
            except (InterfaceError, UnknownTypeError, VersionMismatchError) as error:
                return Table(note=str(error))
        self._shown_interface.read()
        return Table([(name, field_text(value)) for name, value in self._shown_interface.as_dict().items()])

    def _close_shown_interface(self) -> None:
        interface, self._shown_interface = self._shown_interface, None
        if interface is not None and interface.valid:
            with suppress(CxbridgeError):
                interface.close()

    def _find_facts(self, query: ViewQuery) -> Table:
        return self._search.find(query, lambda **arguments: self._request("find-facts", **arguments))

    def _read_agenda(self, query: ViewQuery) -> Table:
        # One row more than the table shows, to know whether there are more.
        rows = self._request("agenda", env=query.env, limit=MAX_ROWS + 1)
        table = make_filtered_table(
            ((str(salience), rule, facts) for salience, rule, facts in rows), query.filter_text, ""
        )
        return Table(table.rows[:MAX_ROWS], f"more than {MAX_ROWS}" if len(rows) > MAX_ROWS else "")

    # -- commands

    def execute_command(self, command: str) -> str:
        """Execute a command of :data:`COMMANDS_HELP`.

        :raises CxbridgeError: if the command is unknown or fails, or the daemon rejects it.
        """
        return execute_command(self._commands, command, COMMANDS_HELP)

    def _send_command(self, verb: str) -> str:
        if not send_command(self._connect_board(), verb, REPLY_TIMEOUT_S):
            raise CxbridgeError(f"the daemon did not {verb.lower()} within {REPLY_TIMEOUT_S:g} s")
        return ""

    def _add_breakpoint(self, spec: str) -> str:
        if not spec:
            raise CxbridgeError(
                "a breakpoint is missing",
                hint="break rule:NAME, goal:NAME:MODE, action:NAME:STATE, skill:TEXT",
            )
        return ", ".join(f"breakpoint {row['number']}" for row in self._request("break-add", specs=[spec]))


class _FactSearch:
    """A search of facts in steps, since a daemon searches only a part of the facts in a loop."""

    def __init__(self) -> None:
        self._query: tuple[str, str] | None = None
        self._last_result = Table()
        self._next_search_s = 0.0
        self._restart()

    def _restart(self) -> None:
        self._rows: list[tuple[str, ...]] = []
        # the index of the last searched fact, 0 at the beginning; None if all facts have been searched
        self._position: int | None = 0
        self._search_time_s = 0.0
        self._is_over = False

    def find(self, query: ViewQuery, request_facts: Callable[..., Mapping[str, Any]]) -> Table:
        """Continue the search for a while.

        :param request_facts: sends a request for further facts and returns the reply.
        :returns: the facts found so far, or the last complete result if it has as many.
        """
        begin_s = time.monotonic()
        if (query.env, query.filter_text) != self._query:
            self._query, self._last_result = (query.env, query.filter_text), Table()
            self._restart()
        elif self._is_over and begin_s >= self._next_search_s:
            self._restart()
        if self._is_over:
            return self._last_result
        while self._position is not None and len(self._rows) <= MAX_ROWS:
            reply = request_facts(
                env=query.env, words=query.filter_text, after=self._position, limit=MAX_ROWS + 1
            )
            self._rows += [(f"f-{index}", text) for index, text in reply["facts"]]
            self._position = reply["after"]
            if time.monotonic() - begin_s > _SEARCH_SLICE_S:
                break
        self._search_time_s += time.monotonic() - begin_s
        is_truncated = len(self._rows) > MAX_ROWS
        if self._position is None or is_truncated:
            note = f"the first {MAX_ROWS}: / finds further facts" if is_truncated else ""
            self._last_result, self._is_over = Table(self._rows[:MAX_ROWS], note), True
            self._next_search_s = time.monotonic() + max(_MIN_PAUSE_S, _PAUSE_FACTOR * self._search_time_s)
        elif len(self._rows) > len(self._last_result.rows):
            return Table(list(self._rows), "looking ...")
        return self._last_result


def _read_table_or_note(read: Callable[[ViewQuery], Table], query: ViewQuery) -> Table:
    """Return a table, or an empty table with the error of its request as a note.

    A lost connection is an error of the whole snapshot.
    """
    try:
        return read(query)
    except (BlackBoardError, NoAnswerError):
        raise
    except CxbridgeError as error:
        return Table(note=error.message)


def _make_goal_row(**goal: str) -> GoalRow:
    """Return the row of a goal in a daemon's reply, whose members have the names of CLIPS' slots."""
    return GoalRow("executive", goal.pop("id"), goal.pop("class"), **goal)


def describe_stop(stop: Mapping[str, Any]) -> str:
    """Return the reason why the rules are stopped, and the next rule, as a text."""
    number = f" (breakpoint {stop['breakpoint']})" if stop["breakpoint"] else ""
    return f"rules stopped {stop['reason']}{number}; next: {stop['next_rule'] or '-'}"


def _parse_numbers(text: str) -> list[int]:
    # an empty text counts as a word, which parse_number() rejects
    return [parse_number(word) for word in text.split() or [text]]
