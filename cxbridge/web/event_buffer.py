"""The newest events as text, kept in bounded room, for those who follow them at their own pace."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from heapq import merge
from itertools import islice
from typing import Any, Final, NamedTuple

from cxbridge.events import Event, InterfaceWrite
from cxbridge.trace.codec import encode_with_kind

MOST_EVENTS: Final = 10_000
"""Events of each group that are kept."""

MOST_BYTES: Final = 16 << 20
"""Bytes of text of each group that are kept."""

BUNCH_BYTES: Final = 64 << 10
"""Bytes after which a bunch is sent."""

HISTORY: Final = frozenset({"goal", "plan-action", "skill", "planner"})
"""Kinds that tell what a run has done. They are a group of their own: the many other events, facts and log
lines above all, do not crowd them out, so that a client that comes late has them."""


@dataclass(frozen=True, slots=True)
class EventSelection:
    """Which events somebody wants.

    :param kinds: by their names in :data:`~cxbridge.event_kinds.EVENT_TYPES`.
    :param env: of this environment, and those that belong to none; empty: of all.
    """

    kinds: frozenset[str]
    env: str = ""

    def wants(self, kind: str, env: str) -> bool:
        """Whether an event is one of them."""
        return kind in self.kinds and (not self.env or not env or env == self.env)


class Position(NamedTuple):
    """How far a client has come.

    :param history: how many events of :data:`HISTORY` there were up to there.
    :param others: how many others.
    :param lost: how many were gone before they came here.
    """

    history: int = 0
    others: int = 0
    lost: int = 0

    def __str__(self) -> str:
        return ".".join(map(str, self))


@dataclass(frozen=True, slots=True)
class _BufferedEvent:
    position: Position
    kind: str
    env: str
    text: bytes


class _Group:
    """The newest events of a group, within bounds."""

    def __init__(self, most_events: int, most_bytes: int) -> None:
        self.entries: deque[_BufferedEvent] = deque()
        self.gone = 0
        """How many have made room."""
        self.bytes = 0
        self._most_events = most_events
        self._most_bytes = most_bytes

    def add(self, entry: _BufferedEvent) -> None:
        self.entries.append(entry)
        self.bytes += len(entry.text)
        while len(self.entries) > self._most_events or self.bytes > self._most_bytes:
            self.bytes -= len(self.entries.popleft().text)
            self.gone += 1

    def after(self, count: int) -> list[_BufferedEvent]:
        """Return what came after so many; quick for those who are up to date."""
        later = list(islice(reversed(self.entries), max(0, self.gone + len(self.entries) - count)))
        later.reverse()
        return later


class EventBuffer:
    """Events in their order, in two groups: see :data:`HISTORY`.

    For one thread.
    """

    def __init__(self, most_events: int = MOST_EVENTS, most_bytes: int = MOST_BYTES) -> None:
        self.end = Position()
        """After the event that came last."""
        self._history = _Group(most_events, most_bytes)
        self._others = _Group(most_events, most_bytes)
        self._values: dict[str, Any] = {}

    @property
    def begin(self) -> Position:
        """Before the oldest events that are kept."""
        oldest = [group.entries[0] for group in (self._history, self._others) if group.entries]
        lost = min((entry.position.lost for entry in oldest), default=self.end.lost)
        return Position(self._history.gone, self._others.gone, lost)

    @property
    def count(self) -> int:
        """How many events there were."""
        return sum(self.end)

    @property
    def size(self) -> int:
        """Bytes of text that are kept."""
        return self._history.bytes + self._others.bytes

    def __len__(self) -> int:
        return len(self._history.entries) + len(self._others.entries)

    def skip(self, count: int) -> None:
        """Note that so many events are gone before they came here."""
        self.end = self.end._replace(lost=self.end.lost + count)

    def add(self, events: Iterable[Event]) -> None:
        """Keep events; of each interface what is new, and of what comes together the last."""
        events = list(events)
        last = {event.uid: event for event in events if isinstance(event, InterfaceWrite)}
        for event in events:
            if isinstance(event, InterfaceWrite):
                if last[event.uid] is not event or self._values.get(event.uid) == event.values:
                    continue
                self._values[event.uid] = event.values
            self._keep(event)

    def forget_interfaces(self) -> None:
        """Take the next values of each interface as new."""
        self._values.clear()

    def _keep(self, event: Event) -> None:
        kind, (history, others, lost) = event.KIND.name, self.end
        is_history = kind in HISTORY
        self.end = Position(history + is_history, others + (not is_history), lost)
        entry = _BufferedEvent(self.end, kind, getattr(event, "env", ""), encode_with_kind(event))
        (self._history if is_history else self._others).add(entry)

    def after(
        self, position: Position, selection: EventSelection
    ) -> tuple[list[tuple[Position, bytes]], Position, int]:
        """Return what came after a position: a bunch of about :data:`BUNCH_BYTES`.

        :returns: the events with the positions after them; the position to go on after; how many events are
            gone in between, of the groups that are wanted.
        """
        later = self._history.after(position.history) if selection.kinds & HISTORY else []
        if selection.kinds - HISTORY:
            later = list(merge(later, self._others.after(position.others), key=_order))
        found: list[tuple[Position, bytes]] = []
        size, upto = 0, self.end
        for entry in later:
            if selection.wants(entry.kind, entry.env):
                found.append((entry.position, entry.text))
                size += len(entry.text)
                if size >= BUNCH_BYTES:
                    upto = entry.position
                    break
        return found, upto, self._gone(position, upto, selection)

    def _gone(self, position: Position, upto: Position, selection: EventSelection) -> int:
        """Return how many events between two positions are not kept any more."""
        gone = upto.lost - position.lost
        if selection.kinds & HISTORY:
            gone += max(0, min(upto.history, self._history.gone) - position.history)
        if selection.kinds - HISTORY:
            gone += max(0, min(upto.others, self._others.gone) - position.others)
        return gone


def _order(entry: _BufferedEvent) -> int:
    return entry.position.history + entry.position.others
