"""Writer of interfaces as CSV, with the bytes of Fawkes' ``ffbblog convert``; see docs/formats.md."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from contextlib import closing
from pathlib import Path
from typing import IO, Any, Final

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, InterfaceWrite
from cxbridge.interfaces.fieldtypes import TYPES
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.base import Run, RunWriter
from cxbridge.trace.formats.block_decoder import BlockDecoder
from cxbridge.trace.formats.files import writing
from cxbridge_fawkes.bblogger.header import file_name
from cxbridge_fawkes.bblogger.reader import BBLoggerFile, BBLoggerFolder

_TIME_TITLE: Final = "# Time relative to beginning (in sec)"  # the title of the first column

# As in ffbblog, this text stands for a number that is not an item of an enum.
_UNKNOWN_ITEM: Final = "UNKNOWN"

_SUFFIX = ".csv"


def convert_bblogger(run: Run, path: Path) -> list[str] | None:
    """Convert bblogger files to CSV files directly, with unchanged times and bytes of texts.

    Files of a folder whose interface type has no fitting definition are left out with a note.

    :param path: a CSV file for a single interface, otherwise a folder.
    :returns: notes for the user, or None for a run of another format.
    :raises TraceError: if a file cannot be read or written, if the run is a single file without a fitting
        definition, or if `path` is a CSV file and the run is a folder without exactly one file.
    """
    if isinstance(run, BBLoggerFile):
        _convert_file(run, path / f"{run.path.stem}{_SUFFIX}" if path.is_dir() else path)
        return list(run.notes)
    if not isinstance(run, BBLoggerFolder):
        return None
    file_runs = run.file_runs()
    if path.suffix == _SUFFIX and len(file_runs) != 1:
        raise _make_several_interfaces_error(path)
    notes = list(run.notes)
    if path.suffix != _SUFFIX:
        _make_folder(path)
    for file_run in file_runs:
        if file_run.header.schema is None:
            notes.append(f"{file_run.path.name}: left out: {file_run.header.problem}")
            continue
        _convert_file(file_run, path if path.suffix == _SUFFIX else path / f"{file_run.path.stem}{_SUFFIX}")
        notes += [f"{file_run.path.name}: {note}" for note in file_run.notes]
    return notes


class CsvWriter(RunWriter):
    """Writer of CSV files of the interface writes of any run; times count from the first write.

    :param path: the file of a single interface if the name ends with ``.csv``, otherwise a folder.
    :param registry: the interface types; interfaces of other types are left out with a note.
    :raises TraceError: if the file or the folder cannot be created.
    """

    def __init__(self, path: Path, registry: InterfaceRegistry) -> None:
        self._path = path
        self._registry = registry
        self._is_single_file = path.suffix == _SUFFIX
        self._start_us: int | None = None
        self._files: dict[str, _CsvFile] = {}
        self._omission_reasons: dict[str, str] = {}  # by uid
        if self._is_single_file:
            _create(path).close()
        else:
            _make_folder(path)

    @property
    def notes(self) -> list[str]:
        """Notes for the user about interfaces that were left out."""
        return [f"{uid}: left out: {reason}" for uid, reason in self._omission_reasons.items()]

    def event_types(self, level: RecordLevel) -> frozenset[type[Event]]:  # noqa: ARG002 - CSV has only interface writes at any level
        return frozenset({InterfaceWrite})

    def write(self, event: Event) -> None:
        """Write a row; the first write of an interface creates its file.

        :raises TraceError: if the file cannot be written, if a value does not fit its field, or if a single
            file would get a second interface.
        """
        if not isinstance(event, InterfaceWrite) or event.uid in self._omission_reasons:
            return
        if self._start_us is None:
            self._start_us = event.time_us
        file = self._files.get(event.uid)
        if file is None:
            try:
                file = self._create_file(event.uid)
            except InterfaceError as error:
                self._omission_reasons[event.uid] = error.message
                return
            self._files[event.uid] = file
        file.write(event.time_us - self._start_us, event.values)

    def _create_file(self, uid: str) -> _CsvFile:
        """Create the file of an interface.

        :raises InterfaceError: if the type is unknown.
        :raises TraceError: if the file cannot be created, or a single file would get a second interface.
        """
        schema = self._registry.schema(uid.partition("::")[0])
        if self._is_single_file:
            if self._files:
                raise _make_several_interfaces_error(self._path)
            return _CsvFile(self._path, schema)
        # "run" replaces the scenario, which a writer of copies does not know; `write` has set the start
        name = Path(file_name("run", uid, self._start_us or 0)).with_suffix(_SUFFIX)
        return _CsvFile(self._path / name, schema)

    def flush(self) -> None:
        """Do nothing: a copy of a run is flushed when it is closed."""

    def close(self) -> None:
        while self._files:
            self._files.popitem()[1].close()


class _CsvFile:
    """The file of one interface."""

    def __init__(self, path: Path, schema: InterfaceSchema) -> None:
        self._path = path
        # name, function that formats an element (None for texts), and whether the field is an array
        self._columns = [
            (field.name, None if field.is_string else make_formatter(field.type), field.is_array)
            for field in schema.fields
        ]
        self._file = _create(path)
        self._write_line(format_heading(schema).encode())

    def write(self, elapsed_us: int, values: Mapping[str, Any]) -> None:
        """Write a row.

        :param elapsed_us: the microseconds since the start, for the first column.
        :param values: the values by field; a missing value leaves its cell empty, and bytes are written
            unchanged.
        :raises TraceError: if a value does not fit its field, or the file cannot be written.
        """
        cells = [_format_seconds(elapsed_us)]
        for name, format_element, is_array in self._columns:
            value = values.get(name, b"")
            if isinstance(value, bytes):
                cells.append(value)
                continue
            try:
                elements = value if is_array else [value]
                text = ", ".join(map(format_element, elements)) if format_element else str(value)
            except (TypeError, ValueError):
                # cut to 40 characters, because a crafted recording may have a value of any length
                raise TraceError(
                    f"the recorded value {value!r:.40} does not fit the field '{name}'", file=self._path
                ) from None
            # a recorded text may have a lone surrogate, which is no UTF-8
            cells.append(text.encode("utf-8", "backslashreplace"))
        self._write_line(b";".join(cells))

    def _write_line(self, line: bytes) -> None:
        with writing(self._path):
            self._file.write(line + b"\n")

    def close(self) -> None:
        with writing(self._path):
            self._file.close()


def _convert_file(run: BBLoggerFile, path: Path) -> None:
    header = run.header
    if header.schema is None:
        raise TraceError(header.problem, file=run.path, hint="without a definition there are no columns")
    if header.problem:
        run.note(header.problem)
    decode = BlockDecoder(header.schema, _cut_text).decode
    with closing(_CsvFile(path, header.schema)) as file:
        for elapsed_us, block in run.entries():
            file.write(elapsed_us, decode(block))


def _cut_text(field: bytes) -> bytes:
    # as in ffbblog: a text ends at its first zero byte, but a field of one byte is written even if it is zero
    return field if len(field) == 1 else field.split(b"\0", 1)[0]


def _format_seconds(elapsed_us: int) -> bytes:
    """Return microseconds as seconds, rounded as in Fawkes."""
    # Fawkes adds two doubles: one division would round differently
    seconds, microseconds = divmod(elapsed_us, MICROSECONDS)
    return b"%f" % (seconds + microseconds / MICROSECONDS)


def _create(path: Path) -> IO[bytes]:
    """Create a file.

    :raises TraceError: if the file cannot be created.
    """
    with writing(path):
        return path.open("wb")


def _make_folder(path: Path) -> None:
    """Create a folder unless it exists.

    :raises TraceError: if the path is not a folder, or the folder cannot be created.
    """
    if path.exists() and not path.is_dir():
        raise TraceError(
            "this is not a folder",
            file=path,
            hint="a run with several interfaces is written as a folder with one file per interface",
        )
    with writing(path):
        path.mkdir(exist_ok=True)


def _make_several_interfaces_error(path: Path) -> TraceError:
    return TraceError(
        "the run has several interfaces, or none",
        file=path,
        hint="name a folder: each interface gets a file there",
    )


def format_heading(schema: InterfaceSchema) -> str:
    """Return the first line of a file, which names the columns, without its line feed."""
    columns = (f";{field.name} ({field.type}[{field.runtime_length}])" for field in schema.fields)
    return "".join([_TIME_TITLE, *columns])


def make_formatter(type_name: str) -> Callable[[Any], str]:
    """Return a function that formats one element of a type other than ``string``."""
    if type_name not in TYPES:  # an enum
        return lambda value: value if isinstance(value, str) else _UNKNOWN_ITEM
    formatters: dict[type, Callable[[Any], str]] = {
        bool: lambda value: "true" if value else "false",
        float: _format_float,
        int: str,
    }
    return formatters[TYPES[type_name].python_type]


def _format_float(value: float) -> str:
    """Return a number as C prints it, including the sign of a NaN."""
    return "-nan" if math.isnan(value) and math.copysign(1, value) < 0 else f"{value:f}"
