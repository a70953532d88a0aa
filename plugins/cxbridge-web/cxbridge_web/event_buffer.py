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

MAX_GROUP_EVENTS: Final = 10_000  # limit of the events in each group

MAX_GROUP_BYTES: Final = 16 << 20  # limit of the encoded events in each group

BUNCH_BYTES: Final = 64 << 10  # size at which a bunch of events is complete

# Groups of kinds with separate limits: the transitions of a run, and its log. Facts and interface values are
# far more frequent, and would otherwise displace these events before a late client connects.
GROUPS: Final = (
    frozenset({"goal", "plan-action", "skill", "planner"}),
    frozenset({"log", "message"}),
)

_OTHER_GROUP: Final = len(GROUPS)


def find_group_index(kind: str) -> int:
    """Return the index of a kind's group; the last group has the kinds outside of :data:`GROUPS`."""
    return next((index for index, kinds in enumerate(GROUPS) if kind in kinds), _OTHER_GROUP)


class StreamPosition(NamedTuple):
    """A position in the stream of events.

    :param counts: the number of events of each group up to the position.
    :param lost: the number of events that were lost before they reached the buffer.
    """

    counts: tuple[int, ...] = (0,) * (_OTHER_GROUP + 1)
    lost: int = 0

    def __str__(self) -> str:
        return ".".join(map(str, (*self.counts, self.lost)))

    def advance(self, group_index: int) -> StreamPosition:
        """Return the position after a further event of a group."""
        counts = list(self.counts)
        counts[group_index] += 1
        return StreamPosition(tuple(counts), self.lost)


@dataclass(frozen=True, slots=True)
class _BufferedEvent:
    """An encoded event.

    :param position: the position after the event.
    :param json: the event as JSON.
    """

    position: StreamPosition
    kind: str
    json: bytes


class _Group:
    """The newest events of a group within its limits."""

    def __init__(self, max_events: int, max_bytes: int) -> None:
        self.buffered_events: deque[_BufferedEvent] = deque()
        self.discarded_count = 0
        self.byte_count = 0
        self._max_events = max_events
        self._max_bytes = max_bytes

    def add(self, buffered_event: _BufferedEvent) -> None:
        self.buffered_events.append(buffered_event)
        self.byte_count += len(buffered_event.json)
        while len(self.buffered_events) > self._max_events or self.byte_count > self._max_bytes:
            self.byte_count -= len(self.buffered_events.popleft().json)
            self.discarded_count += 1

    def list_events_after(self, count: int) -> list[_BufferedEvent]:
        """Return the buffered events of the group except the first ``count`` events of the run."""
        # from the newest event backwards, because most clients are up to date and need only a few events
        later_count = max(0, self.discarded_count + len(self.buffered_events) - count)
        return list(islice(reversed(self.buffered_events), later_count))[::-1]


class EventBuffer:
    """Events in order, with limits for each group (see :func:`find_group_index`).

    Not thread-safe.
    """

    def __init__(self, max_events: int = MAX_GROUP_EVENTS, max_bytes: int = MAX_GROUP_BYTES) -> None:
        self.end = StreamPosition()  # position after the newest event
        self._groups = [_Group(max_events, max_bytes) for _ in range(_OTHER_GROUP + 1)]
        self._last_values: dict[str, Any] = {}  # the last values of each interface

    @property
    def begin(self) -> StreamPosition:
        """The position before the oldest buffered event."""
        oldest_events = (group.buffered_events[0] for group in self._groups if group.buffered_events)
        lost = min((buffered_event.position.lost for buffered_event in oldest_events), default=self.end.lost)
        return StreamPosition(tuple(group.discarded_count for group in self._groups), lost)

    def count_lost(self, count: int) -> None:
        """Count events that were lost before they reached the buffer."""
        self.end = self.end._replace(lost=self.end.lost + count)

    def add(self, events: Iterable[Event]) -> None:
        """Add events, without unchanged interface values, and with only the last write to each interface."""
        events = list(events)
        # Clients show the present value, so they need only the last of several writes.
        last_writes = {event.uid: event for event in events if isinstance(event, InterfaceWrite)}
        for event in events:
            if isinstance(event, InterfaceWrite):
                if last_writes[event.uid] is not event or self._last_values.get(event.uid) == event.values:
                    continue
                self._last_values[event.uid] = event.values
            group_index = find_group_index(event.KIND.name)
            self.end = self.end.advance(group_index)
            self._groups[group_index].add(_BufferedEvent(self.end, event.KIND.name, encode_with_kind(event)))

    def forget_interfaces(self) -> None:
        """Forget the interface values, so that the next write to each interface counts as a change."""
        self._last_values.clear()

    def read_bunch_after(
        self, position: StreamPosition, kinds: frozenset[str]
    ) -> tuple[list[tuple[StreamPosition, bytes]], StreamPosition, int]:
        """Return a bunch of about :data:`BUNCH_BYTES` of events after a position.

        :param kinds: names from :data:`~cxbridge.event_kinds.EVENT_TYPES`.
        :returns: the events as JSON, each with the position after it; the position to continue from; the
            number of missing events between the two positions: discarded events of the groups to which the
            kinds belong, and events of any kind that were lost before they reached the buffer.
        """
        group_indices = {find_group_index(kind) for kind in kinds}
        buffered_events = (
            self._groups[index].list_events_after(position.counts[index]) for index in group_indices
        )
        # the sum of the counts is the number of the event in the whole stream, so it restores the order
        later_events = merge(*buffered_events, key=lambda buffered_event: sum(buffered_event.position.counts))
        selected_events: list[tuple[StreamPosition, bytes]] = []
        byte_count, end_position = 0, self.end
        for buffered_event in later_events:
            if buffered_event.kind in kinds:
                selected_events.append((buffered_event.position, buffered_event.json))
                byte_count += len(buffered_event.json)
                if byte_count >= BUNCH_BYTES:
                    end_position = buffered_event.position
                    break
        discarded_count = sum(self._count_discarded(position, end_position, index) for index in group_indices)
        return selected_events, end_position, end_position.lost - position.lost + discarded_count

    def _count_discarded(self, position: StreamPosition, end: StreamPosition, group_index: int) -> int:
        """Return the number of discarded events of a group between two positions."""
        discarded_count = self._groups[group_index].discarded_count
        return max(0, min(end.counts[group_index], discarded_count) - position.counts[group_index])
