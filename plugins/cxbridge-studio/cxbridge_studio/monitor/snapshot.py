"""The values that the monitor shows: the state of a daemon, or of a recorded run at a time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

# limit of the shown rows of a table; a filter finds further rows
MAX_ROWS: Final = 400

MAX_LINES: Final = 1000  # shown log lines


class GoalRow(NamedTuple):
    """A goal.

    :param env: the CLIPS environment of the goal.
    :param parent: the id of the parent goal; ``nil`` or empty for a root.
    """

    env: str
    id: str
    goal_class: str
    parent: str
    mode: str
    outcome: str
    error: str


class LogRow(NamedTuple):
    """A log line.

    :param number: the position of the line in the daemon's log, from 1; in a recording, the index of its
        event, from 0.
    :param level: a letter of :class:`cxbridge.events.Level`.
    """

    number: int
    level: str
    text: str


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of texts, all with the same number of columns.

    :param note: a remark, e.g. the number of further rows.
    :param selected: the index of the row to select; None to keep the user's selection.
    """

    rows: Sequence[tuple[str, ...]] = ()
    note: str = ""
    selected: int | None = None


@dataclass(frozen=True, slots=True)
class ViewQuery:
    """A selection of parts of the state for a snapshot, since the whole state would be too large.

    :param pane: the name of the shown pane.
    :param interface: ``Type::id`` of the interface whose values are shown; empty for none.
    :param env: the CLIPS environment whose facts and agenda are shown.
    :param filter_text: the text, in lower case, that the shown goals and rows must contain.
    """

    pane: str = ""
    interface: str = ""
    env: str = "executive"
    filter_text: str = ""


@dataclass(frozen=True, slots=True)
class MonitorSnapshot:
    """The state of a watched run or daemon.

    :param head: a short text about the state, for the first line of the screen.
    :param omitted_goal_count: the number of goals that are not in ``goals``.
    :param stop: the stop of the rules with its reason, or the last event of a recording; may be empty.
    :param progress: the position in a recording, from 0 to 1; None for a daemon.
    :param fields: the fields of the shown interface.
    :param log: the last log lines, the oldest first.
    :param environments: the names of the CLIPS environments.
    :param story: the lines of the explanation of the run; empty if the query's pane is another.
    :param notes: remarks about the recording.
    """

    head: str
    stop: str = ""
    progress: float | None = None
    goals: Sequence[GoalRow] = ()
    omitted_goal_count: int = 0
    actions: Table = Table()
    skills: Table = Table()
    interfaces: Table = Table()
    fields: Table = Table()
    facts: Table = Table()
    agenda: Table = Table()
    breakpoints: Table = Table()
    events: Table = Table()
    log: Sequence[LogRow] = ()
    environments: Sequence[str] = ()
    story: Sequence[str] = ()
    notes: Sequence[str] = ()


class MonitorSource(Protocol):
    """A daemon or a recording. One thread at a time calls the methods."""

    @property
    def name(self) -> str:
        """A URL or a file name."""

    @property
    def is_live(self) -> bool: ...

    @property
    def period_s(self) -> float:
        """The seconds between two snapshots."""

    def take_snapshot(self, query: ViewQuery) -> MonitorSnapshot:
        """Return the current state.

        :raises CxbridgeError: if the source cannot be reached.
        """

    def execute_command(self, command: str) -> str:
        """Execute a command, and return a message for the user; empty if the screen shows the result.

        :raises CxbridgeError: if the command is invalid or fails, or the source rejects it.
        """

    def close(self) -> None:
        """Stop watching."""
