"""Writes the blocks of a blackboard as Fawkes' bblogger does, a file an interface.

It learns of writes from the bus and reads no interface itself: so it does not appear among the readers.
docs/formats.md describes the files.
"""

from __future__ import annotations

import os
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import BlockWrite, Event
from cxbridge.interfaces.known_hashes import hash_for_wire
from cxbridge.interfaces.registry import default_registry
from cxbridge.trace.formats.base import RunWriter
from cxbridge.trace.formats.bblogger.header import (
    COUNT_OFFSET,
    HEADER_SIZE,
    file_name,
    file_pattern,
    is_header_of,
    pack_count,
    pack_entry,
    pack_header,
)
from cxbridge.trace.formats.files import writing


class BBLoggerWriter(RunWriter):
    """A folder of bblogger files: one for each interface that is written, begun at its first write.

    Each write of an interface, changed or not, is an entry, and whole in the file when :meth:`write` returns.
    The header counts the entries when the files are closed; until then it says "unknown".

    :param folder: where the files go; made if it is missing. Files of an earlier run that had the same
        scenario and start are removed: they would look like this run's.
    :param scenario: the name of the run.
    :param start_us: when the run starts, microseconds since the epoch.
    :param utc: name the files by UTC, for a run on the virtual clock; else by the machine's zone, as Fawkes.
    :raises TraceError: when files cannot be made in the folder.
    """

    def __init__(self, folder: str | Path, scenario: str, *, start_us: int, utc: bool = False) -> None:
        self.folder = Path(folder)
        self._scenario = scenario
        self._start_us = start_us
        self._utc = utc
        self._files: dict[str, _InterfaceFile] = {}
        if self.folder.exists() and not self.folder.is_dir():
            raise TraceError("this is not a folder", file=folder, hint="bblogger writes a file an interface")
        with writing(self.folder):
            self.folder.mkdir(parents=True, exist_ok=True)
            for path in self._left_behind():
                path.unlink()
        if not os.access(self.folder, os.W_OK | os.X_OK):
            raise TraceError("no file can be made in this folder", file=folder, hint="see its permissions")

    def _left_behind(self) -> list[Path]:
        """Return the files of an earlier run of this scenario and start."""
        pattern = file_pattern(self._scenario, self._start_us, utc=self._utc)
        return [path for path in self.folder.glob(pattern) if path.is_file() and self._is_ours(path)]

    def _is_ours(self, path: Path) -> bool:
        """Whether a file is bblogger's, and of this scenario."""
        with path.open("rb") as file:
            return is_header_of(file.read(HEADER_SIZE), self._scenario)

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - see the class
        """Return writes of blocks, at any level."""
        return frozenset({BlockWrite})

    def write(self, event: Event) -> None:
        """Write an entry, into a new file when it is the interface's first."""
        if not isinstance(event, BlockWrite):
            return
        file = self._files.get(event.uid)
        if file is None:
            file = self._files[event.uid] = self._begin(event)
        file.append(pack_entry(event.time_us - self._start_us, event.block))

    def _begin(self, event: BlockWrite) -> _InterfaceFile:
        """Make the file of an interface."""
        header = pack_header(
            self._scenario, event.uid, _hash_for_fawkes(event), len(event.block), start_us=self._start_us
        )
        name = file_name(self._scenario, event.uid, self._start_us, utc=self._utc)
        return _InterfaceFile(self.folder / name, header)

    def flush(self) -> None:
        """Do nothing: every entry is in its file already."""

    def settle(self) -> None:
        """Write the counts; they become "unknown" again with the next entry."""
        for file in self._files.values():
            file.settle()

    def close(self) -> None:
        """Write the counts and close the files."""
        errors = []
        while self._files:
            _, file = self._files.popitem()
            try:
                file.close()
            except TraceError as error:
                errors.append(error)
        if errors:
            raise errors[0]


class _InterfaceFile:
    """The file of one interface. Unbuffered: a process that is killed leaves no entry half written.

    :param header: its first bytes.
    :raises TraceError: when it cannot be made.
    """

    def __init__(self, path: Path, header: bytes) -> None:
        self._path = path
        self._count = 0
        self._settled = False
        self._end = len(header)
        with writing(path):
            self._file = path.open("wb", buffering=0)
            try:
                self._put(header, 0)
            except OSError:
                self._file.close()
                raise

    def append(self, entry: bytes) -> None:
        """Add an entry.

        :raises TraceError: when it cannot be written, as on a full disk; the entry is not counted then.
        """
        with writing(self._path):
            if self._settled:
                self._put(pack_count(0), COUNT_OFFSET)
                self._settled = False
            self._put(entry, self._end)
        self._end += len(entry)
        self._count += 1

    def settle(self) -> None:
        """Write the count.

        :raises TraceError: when the file cannot be written.
        """
        with writing(self._path):
            self._put(pack_count(self._count), COUNT_OFFSET)
        self._settled = True

    def close(self) -> None:
        """Write the count, cut off the rest of a failed write, close the file.

        :raises TraceError: when the file cannot be written.
        """
        with writing(self._path), self._file:
            self._file.truncate(self._end)
            self._put(pack_count(self._count), COUNT_OFFSET)

    def _put(self, data: bytes, offset: int) -> None:
        """Write all of ``data`` at an offset."""
        self._file.seek(offset)
        rest = memoryview(data)
        while rest:
            rest = rest[self._file.write(rest) :]


def _hash_for_fawkes(event: BlockWrite) -> bytes:
    """Return the hash that Fawkes' tools expect of an interface.

    For a definition of ours it is the one that Fawkes has for the same layout. Any other definition, for
    example one of a Fawkes checkout, is foreign, and is known by its own hash.
    """
    kind = event.uid.partition("::")[0]
    registry = default_registry()
    if registry.path(kind) is not None and (schema := registry.schema(kind)).hash == event.hash:
        return hash_for_wire(schema)
    return event.hash
