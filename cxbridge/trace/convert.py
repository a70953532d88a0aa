"""Conversion of a recorded run to another format."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from pkgutil import resolve_name

from cxbridge.event_kinds import RecordLevel
from cxbridge.events import FactChange, SourceRead
from cxbridge.file_access import replaced_file
from cxbridge.history.transitions import TRANSITION_TYPES
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import Attachment, Run, RunWriter
from cxbridge.trace.formats.files import refuse_locked_file
from cxbridge.trace.formats.registry import copy_formats
from cxbridge.trace.sources import run_sources


def convert(run: Run, path: Path, format_name: str) -> list[str]:
    """Copy a run to a new file.

    :param format_name: the name of a format in :func:`copy_formats`.
    :returns: warnings about the copy.
    :raises CxbridgeError: if the run cannot be read, or the file not written; an existing file is then
        unchanged.
    """
    refuse_locked_file(path)
    # a failed copy must leave the existing file, which may be the run itself
    with replaced_file(path) as new_path:
        return _copy_events(run, new_path, format_name)


def _copy_events(run: Run, path: Path, format_name: str) -> list[str]:
    """Copy a run to a new file, which may be incomplete after an error.

    :returns: warnings about the copy.
    """
    copy_format = copy_formats()[format_name]
    direct_copier = copy_format.direct_copier
    if direct_copier and (notes := resolve_name(direct_copier)(run, path)) is not None:
        return list(notes)
    written_count = lost_count = 0
    open_writer: Callable[[Path, InterfaceRegistry], RunWriter] = resolve_name(copy_format.writer)
    with open_writer(path, run.registry) as writer:
        stored_types = writer.event_types(RecordLevel.FACTS)
        writer.describe(run.metadata())
        _copy_files(run, writer, has_origins=SourceRead in stored_types)
        has_facts = False
        for event in run:
            has_facts = has_facts or isinstance(event, FactChange)
            if type(event) in stored_types:
                writer.write(event)
                written_count += 1
            # a format without transitions, such as the text log, has facts from which its reader makes
            # transitions
            elif isinstance(event, TRANSITION_TYPES):
                lost_count += 1
    notes = (
        writer.notes if written_count else [f"{format_name} can store nothing of the run: the copy is empty"]
    )
    if lost_count and not has_facts:
        notes.append(
            f"{lost_count} transitions cannot be stored as {format_name}: the run was recorded without facts"
        )
    return notes


def _copy_files(run: Run, writer: RunWriter, *, has_origins: bool) -> None:
    """Copy the attachments of the run: its source files, and other files.

    :param has_origins: whether the format stores the origins of source files, such as their environment;
        otherwise the source files are left out.
    """
    source_file_names = set()
    for source in run_sources(run):
        if source.file is not None:
            source_file_names.add(source.file.name)
        if has_origins:
            writer.write(source.to_event())
    for file in run.files():
        if file.name not in source_file_names:
            writer.attach(Attachment(file.name, file.media_type, file.read(), file.time_us))
