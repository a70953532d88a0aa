"""Conversion of a recorded run to another format."""

from __future__ import annotations

from pathlib import Path
from pkgutil import resolve_name

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import FactChange, SourceRead
from cxbridge.file_access import replacing
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.trace.formats.base import Attachment, CopyFormat, Run, RunWriter
from cxbridge.trace.formats.files import refuse_locked
from cxbridge.trace.formats.registry import copy_formats
from cxbridge.trace.sources import sources_of


def convert(run: Run, path: Path, to: str) -> list[str]:
    """Copy a run to a new file.

    :param to: the name of a format in :func:`copy_formats`.
    :returns: warnings about the copy.
    :raises CxbridgeError: if the run cannot be read, or the file not written; an existing file is then
        unchanged.
    """
    refuse_locked(path)
    # a run may be converted onto itself, and a failed copy must leave the old file
    with replacing(path) as fresh:
        return _copy_events(run, fresh, to)


def _copy_events(run: Run, path: Path, to: str) -> list[str]:
    """Copy a run to a new file, which may be incomplete after an error.

    :returns: warnings about the copy.
    """
    target = copy_formats()[to]
    if target.exact and (notes := resolve_name(target.exact)(run, path)) is not None:
        return list(notes)
    written = lost = 0
    with _open_writer(target, path, run) as writer:
        stored_types = writer.event_types(RecordLevel.FACTS)
        writer.describe(run.metadata())
        _copy_files(run, writer, sources=SourceRead in stored_types)
        has_facts = False
        for event in run:
            has_facts = has_facts or isinstance(event, FactChange)
            if type(event) in stored_types:
                writer.write(event)
                written += 1
            # a text log has no transitions, but facts from which its reader makes them
            elif isinstance(event, TRANSITION_TYPES):
                lost += 1
    notes = writer.notes if written else [f"nothing of the run has a place in {to}: the copy is empty"]
    if lost and not has_facts:
        notes.append(f"{lost} transitions have no place in {to}: the run was recorded without facts")
    return notes


def _open_writer(target: CopyFormat, path: Path, run: Run) -> RunWriter:
    writer: RunWriter = resolve_name(target.writer)(path, run.registry)
    return writer


def _copy_files(run: Run, writer: RunWriter, *, sources: bool) -> None:
    """Copy the source files and other attachments of the run.

    :param sources: whether the format stores the origin of source files.
    """
    source_files = set()
    for source in sources_of(run):
        if source.file is not None:
            source_files.add(source.file.name)
        if sources:
            writer.write(source.event())
    for file in run.files():
        if file.name not in source_files:
            writer.attach(Attachment(file.name, file.media_type, file.read(), file.time_us))
