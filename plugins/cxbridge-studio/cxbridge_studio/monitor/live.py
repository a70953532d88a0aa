"""The monitor's source for a daemon: reads its state by requests over the blackboard, and sends commands.

Each request costs the daemon time in its loop, so expensive data are requested for the shown pane alone, in
pieces, and with pauses.
"""

from __future__ import annotations

import shlex
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
from cxbridge.interfaces.assignments import assign, field_text
from cxbridge_studio.debugger.fact_words import parse_fact_change, parse_number
from cxbridge_studio.monitor.filtering import duration_text, page
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

ANSWER_S: Final = 5.0  # the timeout of a daemon's reply, in seconds

MAX_GOALS: Final = 1000  # the limit of the requested goals

_MIN_GOALS: Final = 50  # below this number of goals, a reply that is too long has another reason
_RATE_SNAPSHOTS: Final = 20  # the number of snapshots over which the loop rate is averaged
_SEARCH_S: Final = 0.25  # the seconds that a snapshot spends on the search of facts
_PAUSE_FACTOR: Final = 5.0  # the pause between two searches, as a multiple of the time of a search
_MIN_PAUSE_S: Final = 1.0  # the shortest pause between two searches
_STORY_S: Final = 2.0  # the seconds between two stories of the run

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

HELP: Final = (
    "pause, resume, reset, step rule|loop|transition, break SPEC, delete NUMBER..., assert (FACT), "
    "retract INDEX..., modify INDEX (SLOT VALUE)..., eval EXPRESSION, send MESSAGE NAME=VALUE..."
)


class DaemonSource:
    """A watched daemon. After a lost connection, each look tries to reconnect.

    :param name: the daemon's URL.
    :param connect: opens the daemon's blackboard.
    """

    is_live = True
    period_s = 0.3

    def __init__(self, name: str, connect: Callable[[], BlackBoard]) -> None:
        self.name = name
        self._connect = connect
        self._board: BlackBoard | None = None
        self._shown: Interface | None = None  # the interface whose fields are shown
        self._log: deque[LogRow] = deque(maxlen=MAX_LINES)
        self._last_line = 0
        self._started_us: object = None
        self._max_goals = MAX_GOALS
        self._search = _FactSearch()
        self._last_story: Sequence[str] = ()
        self._next_story_s = 0.0
        self._loops: deque[tuple[float, int]] = deque(maxlen=_RATE_SNAPSHOTS)
        self._commands: dict[str, Callable[[str, ViewQuery], str]] = {
            **dict.fromkeys(("pause", "resume", "reset"), self._send_command),
            "step": lambda unit, _query: self._request("step", what=unit or "rule") or "",
            "break": lambda spec, _query: self._add_breakpoint(spec),
            "delete": lambda numbers, _query: self._request("break-remove", numbers=_numbers(numbers)) or "",
            "assert": lambda fact, query: f"f-{self._request('assert', env=query.env, fact=fact)}",
            "retract": self._retract,
            "modify": self._modify,
            "eval": self._eval,
            "send": self._send,
        }

    def close(self) -> None:
        self._close_shown()
        board, self._board = self._board, None
        if board is not None:
            with suppress(CxbridgeError):
                board.shutdown()

    # -- reading

    def look(self, query: ViewQuery) -> MonitorSnapshot:
        """Return the state of the daemon.

        :raises CxbridgeError: if it cannot be reached, or the server is not a daemon.
        """
        try:
            return self._snapshot(self._connected_board(), query)
        except CxbridgeError:
            self.close()  # the next snapshot connects again
            raise

    def _connected_board(self) -> BlackBoard:
        if self._board is None:
            self._board = self._connect()
        if not self._board.connected:
            raise BlackBoardError("the daemon is gone")
        return self._board

    def _snapshot(self, board: BlackBoard, query: ViewQuery) -> MonitorSnapshot:
        status = read_status(board)
        if status["started_us"] != self._started_us:  # a restarted daemon numbers its log from 1 again
            self._started_us, self._last_line, self._search = status["started_us"], 0, _FactSearch()
            self._log.clear()
            self._loops.clear()
        problem = ""
        try:
            state = self._state(query.words)
        except BlackBoardError as error:  # the executive is not running: the blackboard is still shown
            state, problem = _EMPTY_STATE, error.message
        for number, level, component, text in state["log"]:
            self._log.append(LogRow(number, level, f"{level} {component}: {text}"))
            self._last_line = number
        stop = state["where"]
        head = (status["state"].lower(), *self._times(status, state), problem, status["error"])
        return MonitorSnapshot(
            head=" · ".join(filter(None, head)),
            stop="" if stop is None else stop_text(stop),
            goals=[_goal_row(**row) for row in state["goals"]],
            more_goals=state["more_goals"],
            actions=page(
                (tuple(row[slot] for slot in _ACTION_SLOTS) for row in state["actions"]),
                query.words,
                "plan-actions",
            ),
            skills=page((tuple(row) for row in state["skills"]), query.words, "Skillers"),
            interfaces=page(
                (
                    (
                        f"{info.type}::{info.id}",
                        info.writer if info.has_writer else "-",
                        str(info.num_readers),
                    )
                    for info in sorted(board.list_all(), key=lambda info: info.uid)
                ),
                query.words,
                "interfaces",
            ),
            fields=self._fields(board, query),
            facts=_table_or_note(self._facts, query) if query.pane == "facts" and not problem else Table(),
            agenda=_table_or_note(self._agenda, query) if query.pane == "agenda" and not problem else Table(),
            breakpoints=Table([(str(row["number"]), row["spec"]) for row in state["breakpoints"]]),
            log=tuple(self._log),
            story=self._story(board) if query.pane == "story" and not problem else (),
            environments=state["environments"],
        )

    def _times(self, status: Mapping[str, Any], state: Mapping[str, Any]) -> Iterator[str]:
        """Yield the daemon's clock and the state of its main loop."""
        if "time_us" not in state:  # the executive is not running
            return
        kind = status["clock"]
        seconds = (state["time_us"] - status["started_us"]) / MICROSECONDS
        yield f"up {duration_text(seconds)}" + (f" ({kind} clock)" if kind != "real" else "")
        loops = state.get("loops", 0)
        self._loops.append((time.monotonic(), loops))
        (first_s, first_count), (last_s, last_count) = self._loops[0], self._loops[-1]
        rate = f" at {(last_count - first_count) / (last_s - first_s):.0f} Hz" if last_s > first_s else ""
        yield f"loop {loops:,}{rate}"

    def _story(self, board: BlackBoard) -> Sequence[str]:
        """Return the daemon's story of the run, some seconds old at most, or the reason without one."""
        now_s = time.monotonic()
        if now_s >= self._next_story_s:
            self._next_story_s = now_s + _STORY_S
            try:
                explanation = ask_why(board, "", "run", 0, ANSWER_S)
            except CxbridgeError as error:
                self._last_story = (error.message, error.hint or "")
            else:
                self._last_story = self._last_story if explanation is None else explanation["lines"]
        return self._last_story

    def _request(self, verb: str, **arguments: Any) -> Any:
        return request(self._connected_board(), verb, ANSWER_S, **arguments)

    def _state(self, words: str) -> Mapping[str, Any]:
        """Return the daemon's report, with fewer goals if the reply is too long."""
        while True:
            try:
                state: Mapping[str, Any] = self._request(
                    "state", since=self._last_line, goals=self._max_goals, words=words
                )
            except CxbridgeError as error:
                # A reply is a field of RequestInterface, which has a fixed length.
                if "too long" not in error.message or self._max_goals <= _MIN_GOALS:
                    raise
                self._max_goals //= 2
            else:
                return state

    def _fields(self, board: BlackBoard, query: ViewQuery) -> Table:
        if not query.interface or query.pane != "interfaces":
            self._close_shown()
            return Table()
        if self._shown is None or self._shown.uid != query.interface or not self._shown.valid:
            self._close_shown()
            try:
                self._shown = board.open_for_reading(*parse_uid(query.interface), owner=OWNER)
            except (InterfaceError, UnknownTypeError, VersionMismatchError) as error:
                return Table(note=str(error))
        self._shown.read()
        return Table([(name, field_text(value)) for name, value in self._shown.as_dict().items()])

    def _close_shown(self) -> None:
        """Close the shown interface."""
        interface, self._shown = self._shown, None
        if interface is not None and interface.valid:
            with suppress(CxbridgeError):
                interface.close()

    def _facts(self, query: ViewQuery) -> Table:
        return self._search.find(query, lambda **arguments: self._request("find-facts", **arguments))

    def _agenda(self, query: ViewQuery) -> Table:
        rows = self._request("agenda", env=query.env, limit=MAX_ROWS + 1)
        table = page(((str(salience), rule, facts) for salience, rule, facts in rows), query.words, "")
        return Table(table.rows[:MAX_ROWS], f"more than {MAX_ROWS}" if len(rows) > MAX_ROWS else "")

    # -- commands

    def do(self, command: str, query: ViewQuery) -> str:
        """Carry out a command of :data:`HELP`.

        :raises CxbridgeError: if the command is unknown, fails or is refused.
        """
        word, _, argument = command.strip().partition(" ")
        action = self._commands.get(word)
        if action is None:
            raise CxbridgeError(f"there is no command '{word}'", hint=HELP)
        message = action(word if word in {"pause", "resume", "reset"} else argument.strip(), query)
        if word in {"assert", "retract", "modify"}:
            self._search = _FactSearch()  # a new search shows the change without a pause
        return message

    def _send_command(self, verb: str, _query: ViewQuery) -> str:
        if not send_command(self._connected_board(), verb.capitalize(), ANSWER_S):
            raise CxbridgeError(f"the daemon did not {verb} within {ANSWER_S:g} s")
        return ""

    def _add_breakpoint(self, spec: str) -> str:
        if not spec:
            raise CxbridgeError(
                "where?", hint="break rule:NAME, goal:NAME:MODE, action:NAME:STATE, skill:TEXT"
            )
        return ", ".join(f"breakpoint {row['number']}" for row in self._request("break-add", specs=[spec]))

    def _retract(self, indices: str, query: ViewQuery) -> str:
        for index in _numbers(indices):
            self._request("retract", env=query.env, index=index)
        return ""

    def _modify(self, arguments: str, query: ViewQuery) -> str:
        index, slots = parse_fact_change(arguments)
        return f"f-{self._request('modify', env=query.env, index=index, slots=dict(slots))}"

    def _eval(self, expression: str, query: ViewQuery) -> str:
        value = self._request("env-eval", env=query.env, expression=expression)
        return "; ".join(filter(None, (*value["output"], value["text"]))) or "it has no value"

    def _send(self, text: str, query: ViewQuery) -> str:
        """Send a message to the shown interface, whichever program writes it."""
        if not query.interface:
            raise CxbridgeError("to which interface?", hint="choose one on the blackboard")
        try:
            name, *arguments = shlex.split(text)
        except ValueError as error:
            raise CxbridgeError(f"that cannot be sent: {error or 'which message?'}") from None
        with self._connected_board().open_for_reading(*parse_uid(query.interface), owner=OWNER) as interface:
            is_full_name = name in interface.MESSAGES or name.endswith("Message")
            message = interface.create_message(name if is_full_name else f"{name}Message")
            assign(message, arguments)
            return f"sent, message {interface.msgq_enqueue(message)}"


class _FactSearch:
    """An incremental search of facts: a daemon searches only a part in each loop."""

    def __init__(self) -> None:
        self._query: tuple[str, str] | None = None
        self._last_result = Table()
        self._next_search_s = 0.0
        self._start()

    def _start(self) -> None:
        self._rows: list[tuple[str, ...]] = []
        self._position: int | None = 0  # the index after which the search continues; None at its end
        self._spent_s = 0.0
        self._is_over = False

    def find(self, query: ViewQuery, ask: Callable[..., Mapping[str, Any]]) -> Table:
        """Continue the search for a while.

        :returns: the facts found so far, or the last complete result if it has more facts.
        """
        begin_s = time.monotonic()
        if (query.env, query.words) != self._query:
            self._query, self._last_result = (query.env, query.words), Table()
            self._start()
        elif self._is_over and begin_s >= self._next_search_s:
            self._start()
        if self._is_over:
            return self._last_result
        while self._position is not None and len(self._rows) <= MAX_ROWS:
            reply = ask(env=query.env, words=query.words, after=self._position, limit=MAX_ROWS + 1)
            self._rows += [(f"f-{index}", text) for index, text in reply["facts"]]
            self._position = reply["after"]
            if time.monotonic() - begin_s > _SEARCH_S:
                break
        self._spent_s += time.monotonic() - begin_s
        is_cut = len(self._rows) > MAX_ROWS
        if self._position is None or is_cut:
            note = f"the first {MAX_ROWS}: / finds others" if is_cut else ""
            self._last_result, self._is_over = Table(self._rows[:MAX_ROWS], note), True
            self._next_search_s = time.monotonic() + max(_MIN_PAUSE_S, _PAUSE_FACTOR * self._spent_s)
        elif len(self._rows) > len(self._last_result.rows):
            return Table(list(self._rows), "looking ...")
        return self._last_result


def _table_or_note(read: Callable[[ViewQuery], Table], query: ViewQuery) -> Table:
    """Return a table, or the error of its request as a note; a lost connection is the snapshot's error."""
    try:
        return read(query)
    except (BlackBoardError, NoAnswerError):
        raise
    except CxbridgeError as error:
        return Table(note=error.message)


def _goal_row(**goal: str) -> GoalRow:
    return GoalRow("executive", goal.pop("id"), goal.pop("class"), **goal)


def stop_text(stop: Mapping[str, Any]) -> str:
    """Return the rule at which rules are stopped, and the reason."""
    number = f" (breakpoint {stop['breakpoint']})" if stop["breakpoint"] else ""
    return f"rules stopped {stop['reason']}{number}; next: {stop['next_rule'] or '-'}"


def _numbers(text: str) -> list[int]:
    return [
        parse_number(word) for word in text.split() or [text]
    ]  # no word: `number_of` refuses the empty text
