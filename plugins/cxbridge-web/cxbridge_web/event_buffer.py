"""The newest events as text, kept in bounded room, for clients that follow them at their own pace."""

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

GROUPS: Final = (
    frozenset({"goal", "plan-action", "skill", "planner"}),
    frozenset({"log", "message"}),
)
"""Kinds that are kept apart from each other and from the rest: transitions of a run, and its log. So late
clients have them, though facts and values of interfaces are far more frequent."""

_OTHERS: Final = len(GROUPS)


def group_of(kind: str) -> int:
    """Return the number of the group of a kind; kinds without a group belong to the last one."""
    return next((number for number, kinds in enumerate(GROUPS) if kind in kinds), _OTHERS)


@dataclass(frozen=True, slots=True)
class EventSelection:
    """The events that a client wants.

    :param kinds: by their names in :data:`~cxbridge.event_kinds.EVENT_TYPES`.
    :param env: of this environment, and those that belong to none; empty: of all.
    """

    kinds: frozenset[str]
    env: str = ""

    def wants(self, kind: str, env: str) -> bool:
        """Whether an event is one of them."""
        return kind in self.kinds and (not self.env or not env or env == self.env)

    @property
    def groups(self) -> set[int]:
        """The groups that they belong to."""
        return {group_of(kind) for kind in self.kinds}


class StreamPosition(NamedTuple):
    """How far a client has come.

    :param counts: the number of events of each group up to the position; the last is the rest.
    :param lost: the number of events that were lost before the buffer.
    """

    counts: tuple[int, ...] = (0,) * (_OTHERS + 1)
    lost: int = 0

    def __str__(self) -> str:
        return ".".join(map(str, (*self.counts, self.lost)))

    @property
    def total(self) -> int:
        """How many events there were up to there."""
        return sum(self.counts) + self.lost

    def after(self, group: int) -> StreamPosition:
        """Return the position after one more event of a group."""
        counts = list(self.counts)
        counts[group] += 1
        return StreamPosition(tuple(counts), self.lost)


@dataclass(frozen=True, slots=True)
class _BufferedEvent:
    position: StreamPosition
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
        """Return the events after a number; quick for clients that are up to date."""
        later = list(islice(reversed(self.entries), max(0, self.gone + len(self.entries) - count)))
        later.reverse()
        return later


class EventBuffer:
    """Events in their order, each group (:data:`GROUPS`) within its bounds.

    For one thread.
    """

    def __init__(self, most_events: int = MOST_EVENTS, most_bytes: int = MOST_BYTES) -> None:
        self.end = StreamPosition()
        """After the event that came last."""
        self._groups = [_Group(most_events, most_bytes) for _ in range(_OTHERS + 1)]
        self._values: dict[str, Any] = {}

    @property
    def begin(self) -> StreamPosition:
        """Before the oldest events that are kept."""
        oldest = (group.entries[0] for group in self._groups if group.entries)
        lost = min((entry.position.lost for entry in oldest), default=self.end.lost)
        return StreamPosition(tuple(group.gone for group in self._groups), lost)

    @property
    def count(self) -> int:
        """How many events there were."""
        return self.end.total

    @property
    def size(self) -> int:
        """Bytes of text that are kept."""
        return sum(group.bytes for group in self._groups)

    def __len__(self) -> int:
        return sum(len(group.entries) for group in self._groups)

    def skip(self, count: int) -> None:
        """Note events that were lost before the buffer."""
        self.end = self.end._replace(lost=self.end.lost + count)

    def add(self, events: Iterable[Event]) -> None:
        """Keep events; of each interface the changes, and of simultaneous ones the last."""
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
        kind = event.KIND.name
        group = group_of(kind)
        self.end = self.end.after(group)
        entry = _BufferedEvent(self.end, kind, getattr(event, "env", ""), encode_with_kind(event))
        self._groups[group].add(entry)

    def after(
        self, position: StreamPosition, selection: EventSelection
    ) -> tuple[list[tuple[StreamPosition, bytes]], StreamPosition, int]:
        """Return the events after a position: a bunch of about :data:`BUNCH_BYTES`.

        :returns: the events with the positions after them; the position to continue after; the number of
            missing events in between, of the wanted groups.
        """
        groups = selection.groups
        later = merge(*(self._groups[each].after(position.counts[each]) for each in groups), key=_order)
        found: list[tuple[StreamPosition, bytes]] = []
        size, upto = 0, self.end
        for entry in later:
            if selection.wants(entry.kind, entry.env):
                found.append((entry.position, entry.text))
                size += len(entry.text)
                if size >= BUNCH_BYTES:
                    upto = entry.position
                    break
        return (
            found,
            upto,
            upto.lost - position.lost + sum(self._gone(position, upto, each) for each in groups),
        )

    def _gone(self, position: StreamPosition, upto: StreamPosition, group: int) -> int:
        """Return how many events of a group between two positions are not kept any more."""
        return max(0, min(upto.counts[group], self._groups[group].gone) - position.counts[group])


def _order(entry: _BufferedEvent) -> int:
    return sum(entry.position.counts)
