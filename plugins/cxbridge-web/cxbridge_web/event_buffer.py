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

MAX_EVENTS: Final = 10_000  # limit of events in each group

MAX_BYTES: Final = 16 << 20  # limit of encoded bytes in each group

BUNCH_BYTES: Final = 64 << 10  # size at which a bunch of events is complete

# Groups of kinds with separate limits: the transitions of a run, and its log. Facts and interface values are
# far more frequent, and would otherwise displace these events before a late client connects.
GROUPS: Final = (
    frozenset({"goal", "plan-action", "skill", "planner"}),
    frozenset({"log", "message"}),
)

_OTHERS: Final = len(GROUPS)


def group_of(kind: str) -> int:
    """Return the number of a kind's group; the last group has the kinds outside of :data:`GROUPS`."""
    return next((number for number, kinds in enumerate(GROUPS) if kind in kinds), _OTHERS)


@dataclass(frozen=True, slots=True)
class EventSelection:
    """A client's choice of events.

    :param kinds: names from :data:`~cxbridge.event_kinds.EVENT_TYPES`.
    :param env: selects the events of this environment and the events without an environment; empty selects
        all events.
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
        """Return the position after a further event of a group."""
        counts = list(self.counts)
        counts[group] += 1
        return StreamPosition(tuple(counts), self.lost)


@dataclass(frozen=True, slots=True)
class _BufferedEvent:
    """An encoded event.

    :param position: the position after the event.
    """

    position: StreamPosition
    kind: str
    env: str
    text: bytes


class _Group:
    """The newest events of a group within its limits."""

    def __init__(self, max_events: int, max_bytes: int) -> None:
        self.entries: deque[_BufferedEvent] = deque()
        self.discarded = 0  # number of discarded events
        self.bytes = 0
        self._max_events = max_events
        self._max_bytes = max_bytes

    def add(self, entry: _BufferedEvent) -> None:
        self.entries.append(entry)
        self.bytes += len(entry.text)
        while len(self.entries) > self._max_events or self.bytes > self._max_bytes:
            self.bytes -= len(self.entries.popleft().text)
            self.discarded += 1

    def after(self, count: int) -> list[_BufferedEvent]:
        """Return the buffered events of the group except the first ``count`` events of the run."""
        # counted from the newest event: clients that are up to date need only a few
        later = list(islice(reversed(self.entries), max(0, self.discarded + len(self.entries) - count)))
        later.reverse()
        return later


class EventBuffer:
    """Events in order, with limits for each group of :data:`GROUPS`.

    Not thread-safe.
    """

    def __init__(self, max_events: int = MAX_EVENTS, max_bytes: int = MAX_BYTES) -> None:
        self.end = StreamPosition()  # position after the newest event
        self._groups = [_Group(max_events, max_bytes) for _ in range(_OTHERS + 1)]
        self._values: dict[str, Any] = {}  # last values by interface

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
        """Add events, without unchanged interface values, and with only the last write to each interface."""
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
        """Forget the interface values, so that the next write to each interface counts as a change."""
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
