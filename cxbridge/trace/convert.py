"""Copies a recorded run to a file of another format."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import FactChange, SourceRead
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import Attachment, Run, RunWriter
from cxbridge.trace.formats.csv_writer import CsvWriter, convert_to_csv
from cxbridge.trace.formats.fawkes_log_writer import FawkesLogWriter
from cxbridge.trace.formats.foxglove_writer import FoxgloveWriter
from cxbridge.trace.formats.mcap_writer import McapWriter
from cxbridge.trace.formats.transitions_text import TransitionsWriter
from cxbridge.trace.sources import sources_of

WRITERS: Mapping[str, Callable[[Path, InterfaceRegistry], RunWriter]] = {
    "mcap": lambda path, _: McapWriter(path),
    "fawkes-log": lambda path, _: FawkesLogWriter(path, utc=True),
    "transitions": lambda path, _: TransitionsWriter(path),
    "foxglove": lambda path, _: FoxgloveWriter(path),
    "csv": CsvWriter,
}
"""The formats that can be written. Times of day are in UTC, so that converted logs keep theirs."""


def convert(run: Run, path: Path, to: str) -> list[str]:
    """Copy a run to a new file.

    :param to: a name in :data:`WRITERS`.
    :returns: what the user should know of the copy.
    :raises TraceError: when the run cannot be read, or the file not written.
    """
    if to == "csv" and (notes := convert_to_csv(run, path)) is not None:
        return notes
    written = lost = 0
    with WRITERS[to](path, run.registry) as writer:
        kept = writer.event_types(RecordLevel.FACTS)
        writer.describe(run.metadata())
        _copy_files(run, writer, sources=SourceRead in kept)
        facts = False
        for event in run:
            facts = facts or isinstance(event, FactChange)
            if type(event) in kept:
                writer.write(event)
                written += 1
            elif isinstance(event, TRANSITION_TYPES):
                lost += 1
    notes = writer.notes if written else [f"nothing of the run has a place in {to}: the copy is empty"]
    if lost and not facts:
        notes.append(f"{lost} transitions have no place in {to}: the run was recorded without facts")
    return notes


def _copy_files(run: Run, writer: RunWriter, *, sources: bool) -> None:
    """Copy what the run was made of, and what else is attached to it.

    :param sources: whether the format keeps where they come from.
    """
    sourced = set()
    for source in sources_of(run):
        if source.file is not None:
            sourced.add(source.file.name)
        if sources:
            writer.write(source.event())
    for file in run.files():
        if file.name not in sourced:
            writer.attach(Attachment(file.name, file.media_type, file.read(), file.time_us))
