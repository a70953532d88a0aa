"""Reads the CSV files that ``ffbblog convert`` writes (and ``trace convert --to csv``); see docs/formats.md.

They quote nothing: a text may hold semicolons and line feeds. A row ends where the next one begins, with a
time. What belongs to which text follows from the other columns and the lengths of texts; a guess is noted.
"""

from __future__ import annotations

import re
import time
from bisect import bisect_left
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, islice
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from cxbridge.clock import MICROSECONDS
from cxbridge.errors import InterfaceError, TraceError
from cxbridge.events import Event
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.base import FolderRun, Run
from cxbridge.trace.formats.blocks import write_events
from cxbridge.trace.formats.csv.columns import Column, columns_of, csv_files, parse_cell, parse_heading
from cxbridge.trace.formats.files import MAX_LINE, read_lines

_ROW = re.compile(r"(\d{1,12})\.(\d{6})(?:;|\Z)")
_FILE_NAME = re.compile(r"(.*?)-([A-Za-z_]\w*+)-(.*)-")
_FILE_DATE = re.compile(r"\d{4}-\d\d-\d\d-\d\d-\d\d-\d\d")
_DATE_LENGTH = len("2026-01-01-12-00-00")
_INFO_SIZE = 4096
_MAX_SPARE = 1 << 14


@dataclass(frozen=True, slots=True)
class _Source:
    """Where the rows come from, as far as the file says.

    :param start_us: what the times count from, microseconds since the epoch.
    """

    scenario: str
    kind: str
    interface_id: str
    start_us: int


class CsvFile(Run):
    """The writes of one interface.

    Which one it is, and when it began, ``<name>.info.txt`` beside it says (what ``ffbblog info`` printed),
    else its name, else its columns, if only one interface has them.
    """

    format = "csv"

    @cached_property
    def columns(self) -> tuple[Column, ...]:
        """The fields of the interface.

        :raises TraceError: when the first line does not tell them.
        """
        _, text, whole = next(read_lines(self.path), (1, "", False))
        columns = parse_heading(text) if whole else None
        if columns is None:
            raise TraceError("the names of the columns are damaged or cut off", file=self.path, line=1)
        return columns

    def __iter__(self) -> Iterator[Event]:
        """Yield a write for each row, and for a SkillerInterface the state of the skiller."""
        columns, source = self.columns, self._source
        arrays = _arrays(columns, self._schema(source.kind))
        splitter = _Splitter(columns)
        uid = f"{source.kind}::{source.interface_id}"
        for line, text, whole in self._rows():
            match = _ROW.match(text)
            cells = splitter.split(text[match.end() :]) if match else None
            if not whole:
                self.note("the file ends within a row")
            elif match is None or cells is None:
                self.note(f"line {line}: no row, left out")
            else:
                if splitter.ambiguous:
                    self.note(f"line {line}: a text holds ';', where it ends is a guess")
                values: dict[str, Any] = {}
                for column, cell, is_array in zip(columns, cells, arrays, strict=True):
                    parsed = parse_cell(column, cell)
                    values[column.name] = parsed if is_array else parsed[0]
                time_us = source.start_us + int(match[1]) * MICROSECONDS + int(match[2])
                yield from write_events(source.kind, uid, time_us, values)

    def _rows(self) -> Iterator[tuple[int, str, bool]]:
        """Yield the line that a row begins in, the row, and False for a last one whose line has no end."""
        columns = self.columns
        widest = min(32 + sum(each.widest + 1 for each in columns), MAX_LINE)
        first, lines, separators, size, whole = 0, list[str](), 0, 0, True
        for number, text, whole in read_lines(self.path):  # noqa: B007 - used after the loop
            if number == 1:
                continue
            if _ROW.match(text) and (separators >= len(columns) or not lines or size > widest):
                if lines:
                    yield first, "\n".join(lines), True
                lines, separators, size = [], 0, 0
            first = number if not lines else first
            size += len(text) + 1
            if size <= widest or not lines:
                lines.append(text)  # what is too long is not a row anyway, and need not be kept
                separators += text.count(";")
        if lines:
            yield first, "\n".join(lines), whole

    def broken_end(self) -> int | None:
        """Return where the last row begins, in bytes from the start of the file, if it is not whole."""
        line, text, whole = 0, "", True
        for line, text, whole in self._rows():  # noqa: B007 - the last one counts
            pass
        match = _ROW.match(text)
        if not line or (whole and match and _Splitter(self.columns).split(text[match.end() :]) is not None):
            return None
        with self.path.open("rb") as file:
            return sum(len(each) for each in islice(file, line - 1))

    def metadata(self) -> Mapping[str, str]:
        """Return scenario and interface."""
        source = self._source
        return {"scenario": source.scenario, "interface": f"{source.kind}::{source.interface_id}"}

    @cached_property
    def _source(self) -> _Source:
        found = _from_info(self.path.with_suffix(".info.txt")) or _from_name(self.path.stem)
        if found is not None:
            return found
        kinds = [name for name in self.registry.names() if self._has_columns(name)]
        if len(kinds) == 1:
            return _Source("", kinds[0], self.path.stem, 0)
        which = "several interfaces have" if kinds else "no interface that we know has"
        raise TraceError(
            f"neither name nor columns tell which interface it is: {which} these columns",
            file=self.path,
            hint=f"put what 'ffbblog info' prints into {self.path.stem}.info.txt beside it, or name it"
            " <scenario>-<Type>-<id>-YYYY-MM-DD-HH-MM-SS.csv",
        )

    def _has_columns(self, name: str) -> bool:
        schema = self._schema(name)
        return schema is not None and columns_of(schema) == self.columns

    def _schema(self, name: str) -> InterfaceSchema | None:
        """Return the definition of a type, None when there is none that can be read."""
        try:
            return self.registry.schema(name)
        except InterfaceError:
            return None


class CsvFolder(FolderRun):
    """A folder of such files, their rows in the order of time."""

    format = "csv"

    def runs(self) -> list[Run]:
        """Return the files, by name."""
        return [CsvFile(path, self.registry) for path in csv_files(self.path)]


class _Splitter:
    """Splits rows into cells, although texts may hold what separates them."""

    def __init__(self, columns: Sequence[Column]) -> None:
        self._columns = columns
        self._cells = [None if column.is_string else column.cell for column in columns]
        self.ambiguous = False

    def split(self, text: str) -> list[str] | None:
        """Return the cells, None for no row; :attr:`ambiguous` says whether there was a choice."""
        parts = text.split(";") if self._columns else []
        self.ambiguous = False
        spare = len(parts) - len(self._columns)
        if not 0 <= spare <= _MAX_SPARE:
            return None
        choices = self._choices(parts, spare)
        cells, taken = [], 0
        for index, takes in enumerate(choices):
            if taken not in takes:
                return None
            take, several = takes[taken]
            self.ambiguous = self.ambiguous or several
            cells.append(";".join(parts[index + taken : index + taken + take + 1]))
            taken += take
        return cells

    def _choices(self, parts: list[str], spare: int) -> list[dict[int, tuple[int, bool]]]:
        """Return for each column how few spare parts it can take so that the rest fits, and whether more do.

        Both are found by how many spare parts the columns before it took.
        """
        sizes = list(
            accumulate((len(part.encode()) - 3 * part.count("\\x") + 1 for part in parts), initial=0)
        )
        after = {spare: (0, False)}
        found = []
        for index in range(len(self._columns) - 1, -1, -1):
            cell, longest = self._cells[index], self._columns[index].length
            here: dict[int, tuple[int, bool]] = {}
            if cell is not None:
                here = {taken: (0, False) for taken in after if cell.fullmatch(parts[index + taken])}
            else:
                ends = sorted(after)
                for taken in range(spare + 1):
                    first = bisect_left(ends, taken)
                    start = sizes[index + taken] + 1
                    fitting = [
                        end for end in ends[first : first + 2] if sizes[index + end + 1] - start <= longest
                    ]
                    if fitting:
                        here[taken] = (fitting[0] - taken, len(fitting) > 1)
            found.append(here)
            after = here
        found.reverse()
        return found


def _arrays(columns: Sequence[Column], schema: InterfaceSchema | None) -> list[bool]:
    """Return which columns hold arrays: those that the definition calls so, else the longer ones."""
    if schema is not None and columns_of(schema) == tuple(columns):
        return [field.is_array for field in schema.fields]
    return [not column.is_string and column.length > 1 for column in columns]


def _from_info(path: Path) -> _Source | None:
    """Return what ``ffbblog info`` said, if it was kept."""
    try:
        with path.open("rb") as file:
            lines = file.read(_INFO_SIZE).decode("utf-8", "backslashreplace").splitlines()
    except OSError:
        return None
    known = {
        name: value.strip() for name, separator, value in (line.partition(":") for line in lines) if separator
    }
    kind, separator, rest = known.get("Interface", "").partition("::")
    if not separator:
        return None
    interface_id = rest.rpartition(" (")[0] or rest
    return _Source(
        known.get("Scenario", ""),
        kind,
        interface_id,
        _local_us(known.get("Start time", ""), "%a %b %d %H:%M:%S %Y"),
    )


def _from_name(stem: str) -> _Source | None:
    """Return what the name of a file says, if it is one that bblogger gives."""
    date = stem[-_DATE_LENGTH:]
    match = _FILE_NAME.fullmatch(stem[:-_DATE_LENGTH])
    if match is None or _FILE_DATE.fullmatch(date) is None:
        return None
    scenario, kind, interface_id = match.groups()
    return _Source(unquote(scenario), kind, unquote(interface_id), _local_us(date, "%Y-%m-%d-%H-%M-%S"))


def _local_us(text: str, layout: str) -> int:
    """Return a time in the machine's zone as microseconds since the epoch, 0 when it is none."""
    try:
        return int(time.mktime(time.strptime(text, layout))) * MICROSECONDS
    except (ValueError, OverflowError):
        return 0
