"""The source of the event stream: the events of the bus, those of on-demand kinds only on a client's request.

Facts and rules cost time in CLIPS even if no client reads them, so they are watched only on request. Several
threads emit events; a deque for each group of kinds passes them to the server's thread without a lock.
"""

from __future__ import annotations

from collections import Counter, deque
from collections.abc import Callable, Iterable
from heapq import merge
from itertools import count
from operator import itemgetter
from typing import TYPE_CHECKING, Final

from cxbridge.event_kinds import EVENT_TYPES, RecordLevel
from cxbridge.events import Event, RuleFired, Sink
from cxbridge_web.event_buffer import GROUPS, find_group_index

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.watching import WatchItem
    from cxbridge_web.host import WebHost

WATCHED_KINDS: Final = ("fact", "rule")  # kinds of events that CLIPS reports only while they are watched

# The number of events in each group of `GROUPS` that may wait for the server's thread: as many as the
# buffer then holds.
MAX_PENDING: Final = 10_000


def list_default_kinds() -> frozenset[str]:
    """Return the default kinds of a client, which are the kinds of every recording."""
    return frozenset(event_type.KIND.name for event_type in RecordLevel.TRANSITIONS.event_types)


class EventCollector:
    """Passes events from the bus to the server's thread.

    The main loop's thread calls :meth:`poll` and :meth:`close`, the server's thread the other public methods.
    """

    def __init__(self, host: WebHost) -> None:
        self._host = host
        self._pending_events: list[deque[tuple[int, Event]]] = [
            deque(maxlen=MAX_PENDING) for _ in range(len(GROUPS) + 1)
        ]
        self._event_numbers = count()  # the order of events across the groups
        self._lost_count = 0
        self._request_counts: Counter[str] = Counter()  # number of clients by kind
        self._sinks: dict[str, Sink] = {}  # subscribed sinks by kind
        # the watches that this collector has switched on
        self._own_watches: list[tuple[ClipsEnvironment, str]] = []
        self._environments: list[ClipsEnvironment] = []
        # Number of firings by environment and rule, counted while a client requests them.
        self.firings: Counter[tuple[str, str]] = Counter()
        self._on_demand_types = {
            kind: event_type for kind, event_type in EVENT_TYPES.items() if event_type.KIND.on_demand
        }
        permanent_types = (event_type for event_type in EVENT_TYPES.values() if not event_type.KIND.on_demand)
        host.bus.subscribe(self._enqueue, *permanent_types)

    @property
    def counts_firings(self) -> bool:
        """Whether :attr:`firings` are being counted."""
        return "rule" in self._sinks

    # -- in the threads of the emitters

    def _enqueue(self, event: Event) -> None:
        waiting_events = self._pending_events[find_group_index(event.KIND.name)]
        if len(waiting_events) >= MAX_PENDING:
            self._lost_count += 1
        waiting_events.append((next(self._event_numbers), event))

    def _enqueue_firing(self, event: Event) -> None:
        if isinstance(event, RuleFired):
            self.firings[event.env, event.rule] += 1
        self._enqueue(event)

    # -- in the server's thread

    def change_requests(self, kinds: Iterable[str], *, add: bool) -> None:
        """Register or unregister a client's kinds; the next loop applies the change.

        :param add: whether to register the kinds.
        """
        for kind in self._on_demand_types.keys() & set(kinds):
            self._request_counts[kind] += 1 if add else -1

    def take_events(self) -> tuple[list[Event], int]:
        """Return the events since the last call, and the number of events lost in between."""
        lost_count, self._lost_count = self._lost_count, 0
        pending_groups = [[group.popleft() for _ in range(len(group))] for group in self._pending_events]
        return [event for _, event in merge(*pending_groups, key=itemgetter(0))], lost_count

    # -- in the main loop's thread

    def poll(self) -> None:
        """Subscribe to exactly those on-demand kinds that clients request. Called once a loop."""
        requested_kinds = {kind for kind in self._on_demand_types if self._request_counts[kind] > 0}
        environments = list(self._host.environments().values())
        if requested_kinds == self._sinks.keys() and environments == self._environments:
            return
        self._subscribe(requested_kinds, environments)

    def close(self) -> None:
        """Unsubscribe from all events; repeated calls are harmless."""
        self._subscribe(set(), [])
        self._host.bus.unsubscribe(self._enqueue)

    def _subscribe(self, requested_kinds: set[str], environments: list[ClipsEnvironment]) -> None:
        """Replace the subscriptions and watches of on-demand kinds by those of the requested kinds."""
        bus = self._host.bus
        current_environments = list(self._host.environments().values())
        for env, kind in self._own_watches:
            if env in current_environments:  # a closed environment has no watches
                _find_watch_item(env, kind).set((), on=False)
        self._own_watches.clear()
        for sink in self._sinks.values():
            bus.unsubscribe(sink)
        # if a kind has another listener, that listener decides which facts or rules are watched
        unwatched_kinds = [kind for kind in requested_kinds if not bus.wants(self._on_demand_types[kind])]
        self._sinks = {kind: self._make_sink(kind) for kind in requested_kinds}
        for kind, sink in self._sinks.items():
            bus.subscribe(sink, self._on_demand_types[kind])
        for env in environments:
            for kind in unwatched_kinds:
                if kind in WATCHED_KINDS and not _find_watch_item(env, kind):
                    _find_watch_item(env, kind).set((), on=True)  # (): all facts or rules
                    self._own_watches.append((env, kind))
        for env in current_environments:
            env.watcher.set_hooks()  # only for subscribed kinds, because each hook of CLIPS costs time
        self._environments = environments

    def _make_sink(self, kind: str) -> Callable[[Event], None]:
        enqueue = self._enqueue_firing if kind == "rule" else self._enqueue
        return lambda event: enqueue(event)  # noqa: PLW0108 - the bus unsubscribes a sink by its identity


def _find_watch_item(env: ClipsEnvironment, kind: str) -> WatchItem:
    return env.watcher.facts if kind == "fact" else env.watcher.rules
