"""Summaries of recordings."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from cxbridge.clock import MICROSECONDS
from cxbridge.event_kinds import EVENT_TYPES
from cxbridge.trace.formats.base import Run


@dataclass(frozen=True, slots=True)
class Summary:
    """The summary of a recording.

    :param seconds: the time from the first to the last event.
    :param events: the number of events by kind.
    :param attachments: the sizes of the attached files in bytes, by name.
    :param description: lines that are specific to the format.
    :param notes: warnings for the user about the file.
    """

    path: str
    format: str
    seconds: float
    events: dict[str, int]
    metadata: dict[str, str]
    attachments: dict[str, int]
    description: list[str]
    notes: list[str]

    def to_json(self) -> dict[str, Any]:
        """Return the summary as JSON values."""
        return asdict(self)

    def to_lines(self) -> Iterator[str]:
        """Yield the summary as lines of text, without the path and the notes."""
        yield from self.description
        yield f"{'format':12s} {self.format}"
        yield f"{'duration':12s} {self.seconds:.6f} s"
        for name, count in self.events.items():
            yield f"{name:12s} {count} events"
        for name, value in self.metadata.items():
            yield f"{name:12s} {value}"
        for name, size in self.attachments.items():
            yield f"{'attached':12s} {name} ({size} bytes)"


def summarise(run: Run) -> Summary:
    """Read a run and return its summary.

    :raises TraceError: if the run cannot be read.
    """
    counts_by_kind = dict.fromkeys(EVENT_TYPES, 0)
    earliest_us, latest_us = float("inf"), float("-inf")
    # also reads the notes of the run, which are complete after the last event
    for event in run:
        counts_by_kind[event.KIND.name] += 1
        earliest_us, latest_us = min(earliest_us, event.time_us), max(latest_us, event.time_us)
    return Summary(
        path=str(run.path),
        format=run.format,
        seconds=max(0.0, latest_us - earliest_us) / MICROSECONDS,  # 0 without an event
        events={name: count for name, count in counts_by_kind.items() if count},
        metadata=dict(run.metadata()),
        attachments={file.name: file.size for file in run.files()},
        description=list(run.description()),
        notes=list(run.notes),
    )
