"""The base classes of formats: recorded runs, writers, and the entries of the table of formats."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import IO, Any, ClassVar, Final

from msgspec import Struct

from cxbridge.closing import Closing
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event
from cxbridge.interfaces.registry import InterfaceRegistry, default_registry
from cxbridge.numbers import parse_decimal
from cxbridge.trace.formats.files import writing

MAX_NOTES = 100
"""The maximum number of different notes about a run; chosen freely. A damaged text may cause one per line."""


class Attachment(Struct, frozen=True):
    """A file that is recorded with a run, such as a configuration, a CLIPS file or an interface definition.

    :param name: a path below the folder into which ``trace extract`` writes the file.
    :param media_type: e.g. ``text/plain``.
    :param time_us: the time of reading in microseconds since the epoch, 0 if unknown.
    """

    name: str
    media_type: str
    data: bytes
    time_us: int = 0


class StoredFile(Struct, frozen=True):
    """An attachment in a recording, whose data are not read yet.

    :param size: in bytes.
    :param time_us: as in :class:`Attachment`.
    :param read: returns the data; raises TraceError if the data are damaged.
    """

    name: str
    media_type: str
    size: int
    time_us: int
    read: Callable[[], bytes]


class Run(ABC):
    """A recorded run; iterating over it yields its events, any number of times.

    Reading is streamed: memory does not grow with the file. A truncated run is read up to its end, and
    `notes` mentions the truncation after the iteration.

    :param path: the file or folder of the run.
    :param registry: the interface types for formats that need them; None: the shipped types.
    """

    format: str
    """The name of the format, as in ``trace info``."""

    is_timed: ClassVar[bool] = True
    """Whether events have times; otherwise the numbers of lines replace the times."""

    def __init__(self, path: Path, registry: InterfaceRegistry | None = None) -> None:
        self.path = path
        self.registry = registry or default_registry()
        self.notes: list[str] = []

    @abstractmethod
    def __iter__(self) -> Iterator[Event]:
        """Yield the events in recorded order.

        :raises TraceError: if the file cannot be read.
        """

    def select(self, *types: type[Event]) -> Iterator[Event]:
        """Yield the events of some types in recorded order.

        Formats that find the type of an event without decoding override this method, which is then faster.

        :raises TraceError: if the file cannot be read.
        """
        return (event for event in self if type(event) in types)

    def metadata(self) -> Mapping[str, str]:
        """Return the metadata of the run, such as version, spec, clock and exit status; may be empty."""
        return {}

    @property
    def start_us(self) -> int | None:
        """The run's clock at the start, in microseconds since the epoch; None if it was not recorded."""
        return parse_decimal(self.metadata().get("start_us", ""))

    def exit_status(self) -> int | None:
        """Return the exit status of the recorded ``cxbridge run``; None if it was not recorded."""
        return parse_decimal(self.metadata().get("status", ""))

    def attachments(self) -> Iterator[Attachment]:
        """Yield the recorded files with their data, one at a time."""
        for file in self.files():
            yield Attachment(file.name, file.media_type, file.read(), file.time_us)

    def files(self) -> Iterator[StoredFile]:
        """Yield the recorded files without reading their data."""
        return iter(())

    def source_records(self) -> Iterator[Mapping[str, str]]:
        """Yield the unchanged records of the run's sources; see :mod:`cxbridge.trace.sources`."""
        return iter(())

    def description(self) -> Iterator[str]:
        """Yield lines for ``trace info`` that are specific to the format."""
        return iter(())

    def find_repairs(self) -> tuple[list[str], Callable[[Path], object]] | None:
        """Return the needed repairs as texts, and a function that writes the repaired file to a path.

        None means that the run cannot find its repairs: ``trace repair`` then examines the file.

        :raises TraceError: if the file cannot be read, or cannot be repaired.
        """
        return None

    def note(self, text: str) -> None:
        """Add a note for the user unless the note exists.

        After `MAX_NOTES` notes, one last note says that there are more; the further notes are dropped.
        """
        if len(self.notes) <= MAX_NOTES and text not in self.notes:
            self.notes.append(text if len(self.notes) < MAX_NOTES else "and more of this kind")


class RunWriter(Closing):
    """Writes the events of a run to a file; a context manager that closes the file."""

    @abstractmethod
    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:
        """Return the types of events that the format stores of a run recorded at ``level``."""

    @abstractmethod
    def write(self, event: Event) -> None:
        """Write an event of the :meth:`event_types`.

        :raises TraceError: if the file cannot be written.
        """

    @abstractmethod
    def flush(self) -> None:
        """Write buffered events to the file: they are readable even if the program is killed."""

    @abstractmethod
    def close(self) -> None:
        """Complete and close the file; further calls do nothing."""

    @property
    def notes(self) -> list[str]:
        """Warnings for the user about the written file."""
        return []

    def describe(self, metadata: Mapping[str, str]) -> None:
        """Write or extend the run's metadata, such as version, spec, clock and exit status.

        Formats without metadata ignore the call.
        """

    def attach(self, attachment: Attachment) -> None:
        """Write a file of the run; formats without attachments ignore the call."""


class RecordingInfo(Struct, frozen=True):
    """The properties of a run that decide how its recording is written.

    :param registry: the interface types.
    :param scenario: the name of the run in the headers of bblogger files, such as the spec of the agent.
    :param start_us: the start in microseconds since the epoch.
    :param uses_utc: whether times of day are in UTC, for runs on the virtual clock: the files are then the
        same on every machine. Fawkes uses the machine's time zone.
    :param has_files: whether the recording has the files of the run.
    """

    registry: InterfaceRegistry
    scenario: str
    start_us: int
    uses_utc: bool = False
    has_files: bool = True


class StreamWriter(RunWriter):
    """The base of writers of events as lines to an open file; subclasses write the lines.

    :param path: for error messages.
    :param file: closed with the writer.
    """

    def __init__(self, path: Path, file: IO[Any]) -> None:
        self.path = path
        self._file = file

    def flush(self) -> None:
        with writing(self.path):
            self._file.flush()

    def close(self) -> None:
        if not self._file.closed:
            with writing(self.path):
                self._file.close()


class Format(Struct, frozen=True):
    """A readable format of recorded runs; its class is imported when a file needs it.

    :param name: as in ``trace info``.
    :param rank: the order in which formats are tried: low for formats that are recognised reliably.
    :param recognises: returns whether a file or folder has this format, by its path and first
        :data:`HEAD_SIZE` bytes (empty for a folder).
    :param reader: ``module:class`` of the :class:`Run`, or ``module:function``, which returns a run or
        refuses the file; called with the path and the registry of interfaces.
    """

    name: str
    rank: int
    recognises: Callable[[Path, bytes], bool]
    reader: str


class CopyFormat(Struct, frozen=True):
    """A format to which runs can be copied.

    :param name: as in ``trace convert --to``.
    :param rank: the position in lists.
    :param writer: ``module:function`` that opens a file as a :class:`RunWriter`; called with the path and the
        registry of interfaces.
    :param direct_copier: ``module:function`` that copies files of some formats directly, without loss; called
        with the run and the path. The function returns notes on the copy, or None for a run of another
        format. Empty: runs are copied by their events.
    """

    name: str
    rank: int
    writer: str
    direct_copier: str = ""


HEAD_SIZE: Final = 64 * 1024
"""The number of bytes at the start of a file by which a format is recognised.

The first entry of a text log may follow other text; the length of that text is not known, so the number is
chosen freely.
"""
