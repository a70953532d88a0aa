"""Trace events in writing order: slices, instants, counters, flows and names.

A viewer puts a slice into the open slice of its thread, so the slices of a thread must nest, and simultaneous
events must be in the right order: by the number of the event of the run, then by the rank of the trace event.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from enum import IntEnum
from typing import Any, Final

from cxbridge.history.truncation import truncate
from cxbridge_web.escaping import escape_invisible

# The number of an event of the run, and its time in microseconds since the first event.
Moment = tuple[int, int]

# The number of characters in the name of a slice or track; arguments of slices may be longer.
MAX_NAME_LENGTH: Final = 80


def make_label(text: str) -> str:
    """Return a text as a name: one visible line of limited length, never empty."""
    line = escape_invisible(truncate(text.partition("\n")[0], MAX_NAME_LENGTH)).replace("\t", " ")
    return line or "(empty)"


class Rank(IntEnum):
    """The order of the trace events for one event of the run."""

    END_INNER = 0
    END = 1
    END_OUTER = 2
    BEGIN_OUTER = 3
    BEGIN = 4
    BEGIN_INNER = 5
    FLOW = 6
    INSTANT = 7
    END_SAME = 8  # end of a slice that begins with the same event, so after its begin


@dataclass(frozen=True, slots=True)
class Track:
    """A row of a viewer, which the format calls a thread."""

    process: int
    thread: int


@dataclass(slots=True)
class Tracks:
    """Numbers and names processes and their tracks.

    The numbers of tracks are unique in all processes, since Perfetto ignores the process of a thread.
    """

    names: list[dict[str, Any]] = field(default_factory=list)
    _last_process: int = 0
    _last_thread: int = 1000  # above the numbers of all processes

    def add_process(self, name: str) -> int:
        """Add a process below the existing processes; return its number."""
        self._last_process += 1
        self._add_name("process", name, self._last_process, 0)
        return self._last_process

    def add_track(self, process: int, name: str) -> Track:
        """Add and return a track below the existing tracks."""
        self._last_thread += 1
        self._add_name("thread", name, process, self._last_thread)
        return Track(process, self._last_thread)

    def _add_name(self, kind: str, name: str, process: int, thread: int) -> None:
        base_fields = {"ph": "M", "pid": process, "tid": thread, "ts": 0}
        index = thread or process
        self.names.append({**base_fields, "name": f"{kind}_name", "args": {"name": make_label(name)}})
        self.names.append({**base_fields, "name": f"{kind}_sort_index", "args": {"sort_index": index}})


class Lanes:
    """Tracks of one name for slices that may overlap: each lane is a track.

    :param title: the name of the tracks.
    :param is_numbered: whether the names of further tracks have numbers.
    """

    def __init__(self, tracks: Tracks, process: int, title: str, *, is_numbered: bool = False) -> None:
        self._tracks, self._process, self._title, self._is_numbered = tracks, process, title, is_numbered
        # Each track with the number of the event that ends its last slice.
        self._lanes: list[tuple[Track, int]] = []

    def reserve_track(self, begin: Moment, end: Moment) -> Track:
        """Return a track that is free at the start of a slice, and reserve the track until the end."""
        for number, (track, end_number) in enumerate(self._lanes):
            if end_number <= begin[0]:
                self._lanes[number] = track, end[0]
                return track
        number = len(self._lanes) + 1
        suffix = f" ({number})" if self._is_numbered and number > 1 else ""
        track = self._tracks.add_track(self._process, f"{self._title}{suffix}")
        self._lanes.append((track, end[0]))
        return track


@dataclass(slots=True)
class TraceEvents:
    """Collects trace events and yields them in order."""

    _events: list[tuple[int, int, int, dict[str, Any]]] = field(default_factory=list)
    # The time of the last instant of each track, and the number of earlier instants at that time.
    _last_instants: dict[Track, tuple[int, int]] = field(default_factory=dict)

    def add_slice(
        self,
        track: Track,
        name: str,
        begin: Moment,
        end: Moment,
        args: Mapping[str, Any],
        *,
        category: str,
        depth: int = 0,
    ) -> None:
        """Add a slice.

        :param depth: 0 for the outermost slice of its thread, up to 2.
        """
        is_empty, name = begin[0] == end[0], make_label(name)
        begin_event = {"ph": "B", "name": name, "cat": category, "args": dict(args)}
        self._add(begin, Rank.BEGIN_OUTER + depth, track, begin_event)
        # an inner slice ends before its outer slice
        rank = Rank.END_SAME + 2 - depth if is_empty else Rank.END_OUTER - depth
        self._add(end, rank, track, {"ph": "E", "name": name, "cat": category})

    def add_instant(
        self, track: Track, name: str, moment: Moment, args: Mapping[str, Any], *, category: str
    ) -> None:
        """Add an instant. The instants of a track must be added in order.

        Viewers stack simultaneous instants, so a nanosecond between instants keeps them on one line.
        """
        time_us, count = self._last_instants.get(track, (-1, 0))
        count = count + 1 if time_us == moment[1] else 0
        self._last_instants[track] = moment[1], count
        event: dict[str, Any] = {
            "ph": "i",
            "s": "t",  # an instant of a thread
            "name": make_label(name),
            "cat": category,
            "args": dict(args),
        }
        self._add(moment, Rank.INSTANT, track, event)
        if count:
            event["ts"] = moment[1] + count / 1000

    def add_counter(self, track: Track, name: str, moment: Moment, values: Mapping[str, int]) -> None:
        self._add(moment, Rank.INSTANT, track, {"ph": "C", "name": name, "args": dict(values)})

    def add_flow(self, number: int, name: str, steps: list[tuple[Track, Moment]]) -> None:
        """Add an arrow through the slices that are open in at least two tracks at the given moments."""
        last_index = len(steps) - 1
        for index, (track, moment) in enumerate(steps):
            phase = "s" if index == 0 else "f" if index == last_index else "t"
            event: dict[str, Any] = {"ph": phase, "id": number, "name": name, "cat": "flow"}
            if phase == "f":
                event["bp"] = "e"  # the arrow ends at the enclosing slice, not at the next slice
            self._add(moment, Rank.FLOW, track, event)

    def _add(self, moment: Moment, rank: int, track: Track, event: dict[str, Any]) -> None:
        event |= {"ts": moment[1], "pid": track.process, "tid": track.thread}
        self._events.append((moment[0], rank, len(self._events), event))

    def __iter__(self) -> Iterator[dict[str, Any]]:
        """Yield the events in the order of the run."""
        self._events.sort(key=lambda event: event[:3])
        return (event for *_, event in self._events)
