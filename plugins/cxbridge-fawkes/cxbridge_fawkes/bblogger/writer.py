"""Writer of bblogger files, one per interface, as in Fawkes; docs/formats.md describes the files.

The writer gets the writes from the event bus. It opens no interface, so that it is not among an interface's
readers.
"""

from __future__ import annotations

import os
from contextlib import ExitStack
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import BlockWrite, Event
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.formats.base import RecordingInfo, RunWriter
from cxbridge.trace.formats.files import writing
from cxbridge_fawkes.bblogger.header import (
    COUNT_OFFSET,
    file_name,
    pack_count,
    pack_entry,
    pack_header,
)
from cxbridge_fawkes.network.hashes import fawkes_hash


class BBLoggerWriter(RunWriter):
    """Writer of a folder of bblogger files, one per written interface.

    Each write, changed or not, becomes an entry, which is complete in the file when :meth:`write` returns.
    The header has the number of entries only after the file is closed.

    :param folder: created if necessary.
    :param scenario: the name of the run.
    :param start_us: the start of the run in microseconds since the epoch.
    :param utc: whether the dates in file names are in UTC, for runs on the virtual clock; otherwise they are
        in the machine's time zone, as in Fawkes.
    :raises TraceError: if files cannot be created in the folder.
    """

    def __init__(self, folder: str | Path, scenario: str, *, start_us: int, utc: bool = False) -> None:
        self.folder = Path(folder)
        self._scenario = scenario
        self._start_us = start_us
        self._utc = utc
        self._files: dict[str, _InterfaceFile] = {}
        self._open_files = ExitStack()
        if self.folder.exists() and not self.folder.is_dir():
            raise TraceError(
                "this is not a folder", file=folder, hint="bblogger writes one file per interface"
            )
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
        if not os.access(self.folder, os.W_OK | os.X_OK):
            raise TraceError(
                "no file can be created in this folder", file=folder, hint="check its permissions"
            )

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - bblogger has all writes at any level
        return frozenset({BlockWrite})

    def write(self, event: Event) -> None:
        """Append an entry; the first write of an interface creates its file.

        :raises TraceError: if the file cannot be created or written.
        """
        if not isinstance(event, BlockWrite):
            return
        file = self._files.get(event.uid)
        if file is None:
            file = self._files[event.uid] = self._create_file(event)
        file.append(pack_entry(event.time_us - self._start_us, event.block))

    def _create_file(self, event: BlockWrite) -> _InterfaceFile:
        hash_ = fawkes_hash(default_registry(), event.uid.partition("::")[0], event.hash)
        header = pack_header(self._scenario, event.uid, hash_, len(event.block), start_us=self._start_us)
        name = file_name(self._scenario, event.uid, self._start_us, utc=self._utc)
        file = _InterfaceFile(self.folder / name, header)
        self._open_files.callback(file.close)
        return file

    def flush(self) -> None:
        """Do nothing: each entry is in its file already."""

    def close(self) -> None:
        """Write the numbers of entries and close the files."""
        self._open_files.close()  # closes all, even if one of them cannot be written, e.g. on a full disk
        self._files.clear()


class _InterfaceFile:
    """The file of one interface.

    The file is unbuffered, so that a killed process loses no appended entry.

    :param header: the first bytes.
    :raises TraceError: if the file cannot be created.
    """

    def __init__(self, path: Path, header: bytes) -> None:
        self._path = path
        self._count = 0
        self._end_offset = len(header)
        with writing(path):
            self._file = path.open("wb", buffering=0)
            try:
                self._write_at(header, 0)
            except OSError:
                self._file.close()
                raise

    def append(self, entry: bytes) -> None:
        """Append an entry.

        :raises TraceError: if the entry cannot be written, as on a full disk; the entry is then not counted.
        """
        with writing(self._path):
            self._write_at(entry, self._end_offset)
        self._end_offset += len(entry)
        self._count += 1

    def close(self) -> None:
        """Remove a partial entry, write the number of entries and close the file.

        :raises TraceError: if the file cannot be written.
        """
        with writing(self._path), self._file:
            self._file.truncate(self._end_offset)
            self._write_at(pack_count(self._count), COUNT_OFFSET)

    def _write_at(self, content: bytes, offset: int) -> None:
        self._file.seek(offset)
        unwritten = memoryview(content)
        # an unbuffered file may write only a part of the content
        while unwritten:
            unwritten = unwritten[self._file.write(unwritten) :]


def open_recording(folder: Path, recording_info: RecordingInfo) -> BBLoggerWriter:
    """Open a folder for the files of a run.

    :raises TraceError: if files cannot be created in the folder.
    """
    return BBLoggerWriter(
        folder, recording_info.scenario, start_us=recording_info.start_us, utc=recording_info.uses_utc
    )
