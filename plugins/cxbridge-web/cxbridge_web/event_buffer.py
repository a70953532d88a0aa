"""A bounded buffer of the newest encoded events, for clients that read at different speeds.

Each client has a position in the stream of events. A client that is slow, or connects late, misses the events
that the buffer has discarded by then, and learns how many.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from heapq import merge
from itertools import islice
from typing import Any, Final, NamedTuple

from cxbridge.events import Event, InterfaceWrite
from cxbridge.trace.codec import encode_with_kind

MOST_EVENTS: Final = 10_000  # limit of events in each group

MOST_BYTES: Final = 16 << 20  # limit of encoded bytes in each group

BUNCH_BYTES: Final = 64 << 10  # size in bytes at which a bunch is sent

# Kinds with separate limits: transitions of a run, and its log. A late client then still gets them, although
# facts and interface values are far more frequent.
GROUPS: Final = (
    frozenset({"goal", "plan-action", "skill", "planner"}),
    frozenset({"log", "message"}),
)

_OTHERS: Final = len(GROUPS)


def group_of(kind: str) -> int:
    """Return the number of a kind's group; the last group has all kinds without one."""
    return next((number for number, kinds in enumerate(GROUPS) if kind in kinds), _OTHERS)


@dataclass(frozen=True, slots=True)
class EventSelection:
    """A client's choice of events.

    :param kinds: names from :data:`~cxbridge.event_kinds.EVENT_TYPES`.
    :param env: selects the events of this environment and those of none; empty selects all.
    """

    kinds: frozenset[str]
    env: str = ""

    def wants(self, kind: str, env: str) -> bool:
        """Return whether an event is selected."""
        return kind in self.kinds and (not self.env or not env or env == self.env)

    @property
    def groups(self) -> set[int]:
        """The groups of the selected kinds."""
        return {group_of(kind) for kind in self.kinds}


class StreamPosition(NamedTuple):
    """A position in the stream of events.

    :param counts: the number of events of each group up to the position.
    :param lost: the number of events that were lost before the buffer.
    """

    counts: tuple[int, ...] = (0,) * (_OTHERS + 1)
    lost: int = 0

    def __str__(self) -> str:
        return ".".join(map(str, (*self.counts, self.lost)))

    @property
    def total(self) -> int:
        """The number of events up to the position."""
        return sum(self.counts) + self.lost

    def after(self, group: int) -> StreamPosition:
        """Return the position after one more event of a group."""
        counts = list(self.counts)
        counts[group] += 1
        return StreamPosition(tuple(counts), self.lost)


@dataclass(frozen=True, slots=True)
class _BufferedEvent:
    """An encoded event.

    :param position: the position after it.
    """

    position: StreamPosition
    kind: str
    env: str
    text: bytes


class _Group:
    """The newest events of a group within its limits."""

    def __init__(self, most_events: int, most_bytes: int) -> None:
        self.entries: deque[_BufferedEvent] = deque()
        self.discarded = 0  # number of discarded events
        self.bytes = 0
        self._most_events = most_events
        self._most_bytes = most_bytes

    def add(self, entry: _BufferedEvent) -> None:
        self.entries.append(entry)
        self.bytes += len(entry.text)
        while len(self.entries) > self._most_events or self.bytes > self._most_bytes:
            self.bytes -= len(self.entries.popleft().text)
            self.discarded += 1

    def after(self, count: int) -> list[_BufferedEvent]:
        """Return the events after a count; fast for clients that are up to date."""
        later = list(islice(reversed(self.entries), max(0, self.discarded + len(self.entries) - count)))
        later.reverse()
        return later


class EventBuffer:
    """Events in order, with limits for each group of :data:`GROUPS`.

    Not thread-safe.
    """

    def __init__(self, most_events: int = MOST_EVENTS, most_bytes: int = MOST_BYTES) -> None:
        self.end = StreamPosition()  # position after the newest event
        self._groups = [_Group(most_events, most_bytes) for _ in range(_OTHERS + 1)]
        self._values: dict[str, Any] = {}

    @property
    def begin(self) -> StreamPosition:
        """The position before the oldest buffered event."""
        oldest = (group.entries[0] for group in self._groups if group.entries)
        lost = min((entry.position.lost for entry in oldest), default=self.end.lost)
        return StreamPosition(tuple(group.discarded for group in self._groups), lost)

    @property
    def count(self) -> int:
        """The number of events so far."""
        return self.end.total

    @property
    def size(self) -> int:
        """The number of buffered bytes."""
        return sum(group.bytes for group in self._groups)

    def __len__(self) -> int:
        return sum(len(group.entries) for group in self._groups)

    def skip(self, count: int) -> None:
        """Count events that were lost before the buffer."""
        self.end = self.end._replace(lost=self.end.lost + count)

    def add(self, events: Iterable[Event]) -> None:
        """Add events; unchanged interface values are dropped, and of simultaneous writes all but the last."""
        events = list(events)
        # Clients show the present value, so they need only the last of several writes.
        last = {event.uid: event for event in events if isinstance(event, InterfaceWrite)}
        for event in events:
            if isinstance(event, InterfaceWrite):
                if last[event.uid] is not event or self._values.get(event.uid) == event.values:
                    continue
                self._values[event.uid] = event.values
            self._append(event)

    def forget_interfaces(self) -> None:
        """Forget interface values, so that the next value of each interface counts as changed."""
        self._values.clear()

    def _append(self, event: Event) -> None:
        kind = event.KIND.name
        group = group_of(kind)
        self.end = self.end.after(group)
        entry = _BufferedEvent(self.end, kind, getattr(event, "env", ""), encode_with_kind(event))
        self._groups[group].add(entry)

    def after(
        self, position: StreamPosition, selection: EventSelection
    ) -> tuple[list[tuple[StreamPosition, bytes]], StreamPosition, int]:
        """Return a bunch of about :data:`BUNCH_BYTES` of events after a position.

        :returns: the events, each with the position after it; the position to continue from; the number of
            missing events of the selected groups.
        """
        groups = selection.groups
        entries = (self._groups[group].after(position.counts[group]) for group in groups)
        later = merge(*entries, key=lambda entry: sum(entry.position.counts))
        selected_events: list[tuple[StreamPosition, bytes]] = []
        size, end_position = 0, self.end
        for entry in later:
            if selection.wants(entry.kind, entry.env):
                selected_events.append((entry.position, entry.text))
                size += len(entry.text)
                if size >= BUNCH_BYTES:
                    end_position = entry.position
                    break
        discarded = sum(self._discarded_between(position, end_position, group) for group in groups)
        return selected_events, end_position, end_position.lost - position.lost + discarded

    def _discarded_between(self, position: StreamPosition, upto: StreamPosition, group: int) -> int:
        """Return the number of discarded events of a group between two positions."""
        return max(0, min(upto.counts[group], self._groups[group].discarded) - position.counts[group])
