"""The newest events as text, kept in bounded room, for those who follow them at their own pace."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Final

from cxbridge.events import Event, InterfaceWrite
from cxbridge.trace.codec import encode_with_kind

MOST_EVENTS: Final = 10_000
"""Events that are kept."""

MOST_BYTES: Final = 16 << 20
"""Bytes of text that are kept."""

BUNCH_BYTES: Final = 64 << 10
"""Bytes after which a bunch is sent."""


@dataclass(frozen=True, slots=True)
class EventSelection:
    """Which events somebody wants.

    :param kinds: by their names in :data:`~cxbridge.event_kinds.EVENT_TYPES`.
    :param env: of this environment, and those that belong to none; empty: of all.
    """

    kinds: frozenset[str]
    env: str = ""


@dataclass(frozen=True, slots=True)
class _BufferedEvent:
    number: int
    kind: str
    env: str
    text: bytes


class EventBuffer:
    """Events by numbers that count up; a number that is missing is an event that is gone.

    For one thread.
    """

    def __init__(self, most_events: int = MOST_EVENTS, most_bytes: int = MOST_BYTES) -> None:
        self.newest = 0
        """Number of the event that came last, 0 when there was none."""
        self._entries: deque[_BufferedEvent] = deque()
        self._most_events = most_events
        self._most_bytes = most_bytes
        self._bytes = 0
        self._values: dict[str, Any] = {}

    @property
    def oldest(self) -> int:
        """Number of the oldest event that is kept; of the next one when none is."""
        return self._entries[0].number if self._entries else self.newest + 1

    @property
    def size(self) -> int:
        """Bytes of text that are kept."""
        return self._bytes

    def __len__(self) -> int:
        return len(self._entries)

    def skip(self, count: int) -> None:
        """Note that so many events are gone before they came here."""
        self.newest += count

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
        while len(self._entries) > self._most_events or self._bytes > self._most_bytes:
            self._bytes -= len(self._entries.popleft().text)

    def forget_interfaces(self) -> None:
        """Take the next values of each interface as new."""
        self._values.clear()

    def _keep(self, event: Event) -> None:
        text = encode_with_kind(event)
        self.newest += 1
        self._entries.append(_BufferedEvent(self.newest, event.KIND.name, getattr(event, "env", ""), text))
        self._bytes += len(text)

    def after(self, number: int, selection: EventSelection) -> tuple[list[tuple[int, bytes]], int, int]:
        """Return what came after an event: a bunch of about :data:`BUNCH_BYTES`.

        :returns: numbers and texts; the number to go on after; how many events are gone in between.
        """
        found: list[tuple[int, bytes]] = []
        size, seen, upto = 0, 0, number
        for entry in self._since(number):
            seen, upto = seen + 1, entry.number
            if entry.kind in selection.kinds and (
                not selection.env or not entry.env or entry.env == selection.env
            ):
                found.append((entry.number, entry.text))
                size += len(entry.text)
                if size >= BUNCH_BYTES:
                    break
        else:
            upto = max(number, self.newest)
        return found, upto, upto - number - seen

    def _since(self, number: int) -> list[_BufferedEvent]:
        """Return the entries after a number; quick for those who are up to date."""
        later: list[_BufferedEvent] = []
        for entry in reversed(self._entries):
            if entry.number <= number:
                break
            later.append(entry)
        later.reverse()
        return later
