"""The values that the monitor shows: the state of a daemon, or of a recorded run at a moment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final, NamedTuple, Protocol

MOST_ROWS: Final = 400
"""Facts, activations, plan-actions or events that are shown; a filter finds further ones."""

MOST_LINES: Final = 1000
"""Log lines that are shown."""


class GoalRow(NamedTuple):
    """A goal.

    :param env: its CLIPS environment.
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

    :param number: counts the lines.
    :param level: a letter, as :class:`cxbridge.events.Level` has them.
    """

    number: int
    level: str
    text: str


@dataclass(frozen=True, slots=True)
class Table:
    """Rows of text.

    :param rows: all of them have the same length.
    :param note: a note about them, e.g. how many more there are.
    :param at: the selected row, None without one.
    """

    rows: Sequence[tuple[str, ...]] = ()
    note: str = ""
    at: int | None = None


@dataclass(frozen=True, slots=True)
class ViewQuery:
    """Selects the parts of a snapshot that would be too large to be always in it.

    :param pane: the name of the pane that is shown.
    :param interface: ``Type::id`` of the interface whose values are shown; empty for none.
    :param env: the CLIPS environment whose facts and agenda are shown.
    :param words: only goals and rows that have this text in them, in small letters.
    """

    pane: str = ""
    interface: str = ""
    env: str = "executive"
    words: str = ""


@dataclass(frozen=True, slots=True)
class MonitorSnapshot:
    """The state of the watched run or daemon.

    :param head: in a few words.
    :param stop: where rules are stopped, and why; or what happened last. Empty for nothing.
    :param progress: between 0 and 1, how much of a recording is over; None for a daemon.
    :param tables: by the name of their pane; those of ``fields`` belong to the interface that is shown.
    :param environments: names of the CLIPS environments.
    :param notes: what must be known about a recording.
    """

    head: str
    stop: str = ""
    progress: float | None = None
    goals: Sequence[GoalRow] = ()
    more_goals: int = 0
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
    notes: Sequence[str] = ()


class MonitorSource(Protocol):
    """A daemon or a recording that is watched; called by one thread at a time."""

    @property
    def name(self) -> str:
        """Its name, a URL or a file."""

    @property
    def is_live(self) -> bool:
        """Whether it is a daemon."""

    @property
    def period_s(self) -> float:
        """Seconds between two looks."""

    def look(self, query: ViewQuery) -> MonitorSnapshot:
        """Return how it stands.

        :raises CxbridgeError: when it cannot be reached.
        """

    def do(self, command: str, query: ViewQuery) -> str:
        """Carry out a command; returns the message to show, nothing when the result is visible.

        :raises CxbridgeError: when it is invalid, cannot be done, or is refused.
        """

    def close(self) -> None:
        """Watch no more."""
