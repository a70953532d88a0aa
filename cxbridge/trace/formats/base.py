"""The types of recorded runs: the events of a run, the writer of a file, and the format that opens both."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from heapq import merge
from pathlib import Path
from typing import IO, Any, Final

from msgspec import Struct

from cxbridge.closing import Closing
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry, default_registry
from cxbridge.trace.formats.files import writing

_MOST_DIGITS = 18
MAX_NOTES = 100
"""The number of notes that are kept of a run; a mistake on every line is known by then."""


class Attachment(Struct, frozen=True):
    """A file that travels with a run: a configuration, a .clp, a PDDL, an interface definition.

    :param name: its path, relative to where the run found it.
    :param media_type: e.g. ``text/plain``.
    :param time_us: when it was read, microseconds since the epoch; 0 when that is not known.
    """

    name: str
    media_type: str
    data: bytes
    time_us: int = 0


class StoredFile(Struct, frozen=True):
    """An attachment of a recorded run that is not read yet.

    :param size: in bytes.
    :param read: returns its bytes; raises TraceError when they are damaged.
    """

    name: str
    media_type: str
    size: int
    time_us: int
    read: Callable[[], bytes]


class Run(ABC):
    """A recorded run: iterate over it for its events, as often as you like.

    Reading streams: memory does not grow with the file. A run that was cut off reads up to there, and says
    so in :attr:`notes` when the iteration is over.

    :param path: the file, or the folder, that holds the run.
    :param registry: who knows the types of interfaces, where the format needs it; by default our definitions.
    """

    format: str
    """Name of the format, as ``trace info`` shows it."""

    def __init__(self, path: Path, registry: InterfaceRegistry | None = None) -> None:
        self.path = path
        self.registry = registry or default_registry()
        self.notes: list[str] = []

    @abstractmethod
    def __iter__(self) -> Iterator[Event]:
        """Yield the events in recorded order.

        :raises TraceError: when the file cannot be read (any more).
        """

    def select(self, *types: type[Event]) -> Iterator[Event]:
        """Yield the events of some types in recorded order; formats that can skip further types do.

        :raises TraceError: when the file cannot be read (any more).
        """
        return (event for event in self if type(event) in types)

    def metadata(self) -> Mapping[str, str]:
        """Return the metadata of the run: version, command, spec, clock, result; may be empty."""
        return {}

    @property
    def start_us(self) -> int | None:
        """The run's clock at the start, microseconds since the epoch; None: not recorded."""
        text = self.metadata().get("start_us", "")
        return int(text) if text.isdecimal() and len(text) <= _MOST_DIGITS else None

    def attachments(self) -> Iterator[Attachment]:
        """Yield the files that were recorded with the run, one after the other in memory."""
        for file in self.files():
            yield Attachment(file.name, file.media_type, file.read(), file.time_us)

    def files(self) -> Iterator[StoredFile]:
        """Yield the files that were recorded with the run, without reading them."""
        return iter(())

    def source_records(self) -> Iterator[Mapping[str, str]]:
        """Yield the records of the run's sources, unchanged; see :mod:`cxbridge.trace.sources`."""
        return iter(())

    def description(self) -> Iterator[str]:
        """Yield lines that describe more of the file than all formats have, for ``trace info``."""
        return iter(())

    def note(self, text: str) -> None:
        """Keep ``text`` as a note on this file for the user, once; see :data:`MAX_NOTES`."""
        if len(self.notes) <= MAX_NOTES and text not in self.notes:
            self.notes.append(text if len(self.notes) < MAX_NOTES else "and more of this kind")


class FolderRun(Run):
    """A folder of files with one interface each: their events in the order of time."""

    @abstractmethod
    def runs(self) -> Sequence[Run]:
        """Return the files as runs, by name.

        :raises TraceError: when none of them can be read.
        """

    def __iter__(self) -> Iterator[Event]:
        """Yield the events of all files."""
        runs = self.runs()
        yield from merge(*runs, key=lambda event: event.time_us)
        for run in runs:
            for note in run.notes:
                self.note(f"{run.path.name}: {note}")


class RunWriter(Closing):
    """Writes the events of a run to a file. A context manager: leaving it closes the file."""

    @abstractmethod
    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        """Return the types of events that this format keeps of a run recorded at ``level``."""

    @abstractmethod
    def write(self, event: Event) -> None:
        """Write one event, of one of :meth:`event_types`.

        :raises TraceError: when the file cannot be written.
        """

    @abstractmethod
    def flush(self) -> None:
        """Bring everything written so far into the file, so that a killed run can be read up to here."""

    @abstractmethod
    def close(self) -> None:
        """Finish the file; a second call does nothing."""

    @property
    def notes(self) -> list[str]:
        """Warnings for the user about the written file."""
        return []

    def settle(self) -> None:
        """Bring the file into the state that it would be closed in, as nothing may come for a while."""
        self.flush()

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Write the run's metadata: version, command, spec, clock, result.

        Later calls add to it. Formats without a place for it ignore it.
        """

    def attach(self, attachment: Attachment) -> None:
        """Write a file of the run along with it. Formats without a place for it ignore it."""


class StreamWriter(RunWriter):
    """Writes the events of a run as lines to a file that is open.

    :param path: the file's path, for errors.
    :param file: the file to write; closed with the writer.
    """

    def __init__(self, path: Path, file: IO[Any]) -> None:
        self.path = path
        self._file = file

    def flush(self) -> None:
        """Bring the lines into the file."""
        with writing(self.path):
            self._file.flush()

    def close(self) -> None:
        """Close the file."""
        if not self._file.closed:
            with writing(self.path):
                self._file.close()


class Format(Struct, frozen=True):
    """A format of recorded runs that can be read. The class is named, not imported, until a file needs it.

    :param name: as ``trace info`` shows it.
    :param rank: formats are asked in this order whether a file is theirs, the surest to recognise first.
    :param recognises: whether a file or folder is of this format, by its path and its first
        :data:`HEAD_SIZE` bytes (none for a folder).
    :param reader: ``module:class`` of the :class:`Run`, or a function that returns one or refuses the file;
        called with the path and the registry of interfaces.
    """

    name: str
    rank: int
    recognises: Callable[[Path, bytes], bool]
    reader: str


class CopyFormat(Struct, frozen=True):
    """A format that runs can be copied to.

    :param name: as ``trace convert --to`` takes it.
    :param rank: its place in lists.
    :param writer: ``module:function`` that opens a file as a :class:`RunWriter`; called with the path and the
        registry of interfaces.
    :param exact: ``module:function`` that copies some runs without their events; called with the run and the
        path. It returns notes on the copy, or None for a run that it does not know. Empty: there is none.
    """

    name: str
    rank: int
    writer: str
    exact: str = ""


HEAD_SIZE: Final = 64 * 1024
"""How many bytes of a file the formats get to see when they are asked whether it is theirs."""
