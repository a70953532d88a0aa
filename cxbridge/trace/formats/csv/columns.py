"""The columns of the CSV files that ``ffbblog convert`` writes: their names, and how values are in them."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, TypeAlias

from cxbridge.interfaces.fieldtypes import TYPES
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.files import files_starting

TITLE: Final = "# Time relative to beginning (in sec)"
"""The name of the first column, and what these files begin with."""

UNKNOWN_ITEM: Final = "UNKNOWN"
"""What stands for a number that is not an item of an enum."""

Value: TypeAlias = bool | int | float | str

_HEADING = re.compile(r"(\w+) \((\w+)\[(\d{1,9})\]\)")
_FLOAT = r"-?(?:\d+\.\d{6}|nan|inf)"
_CELLS = {"bool": "true|false", "float": _FLOAT, "double": _FLOAT}
_INTEGER, _ITEM = r"-?\d{1,20}", r"[A-Za-z_]\w*"


def starts_well(head: bytes) -> bool:
    """Whether a file that begins with ``head`` is one of those that ``ffbblog convert`` writes."""
    title = TITLE.encode()
    return head.startswith((title + b";", title + b"\n"))


def csv_files(folder: Path) -> list[Path]:
    """Return the CSV files of interfaces in a folder, by name."""
    return files_starting(folder, "*.csv", len(TITLE) + 1, starts_well)


@dataclass(frozen=True)
class Column:
    """A field of the interface.

    :param type: as XML spells it: a built-in type, or an enum.
    :param length: elements, or bytes of a string; 1 for a single value.
    """

    name: str
    type: str
    length: int

    @property
    def is_string(self) -> bool:
        """Whether it holds text."""
        return self.type == "string"

    @property
    def cell(self) -> re.Pattern[str]:
        """What a cell of this column looks like, unless it is a string's."""
        one = _CELLS.get(self.type, _INTEGER if self.type in TYPES else _ITEM)
        return re.compile(f"(?:{one})(?:, (?:{one})){{{self.length - 1}}}")

    @property
    def widest(self) -> int:
        """The most characters that a cell can have."""
        return self.length * (4 if self.is_string else 320)


def columns_of(schema: InterfaceSchema) -> tuple[Column, ...]:
    """Return the columns of an interface."""
    return tuple(Column(field.name, field.runtime_type, field.runtime_length) for field in schema.fields)


def heading(columns: Sequence[Column]) -> str:
    """Return the first line of a file, without its end."""
    return "".join([TITLE, *(f";{each.name} ({each.type}[{each.length}])" for each in columns)])


def parse_heading(line: str) -> tuple[Column, ...] | None:
    """Return the columns that a first line names, None when it is none."""
    title, *names = line.split(";")
    if title != TITLE:
        return None
    matches = [_HEADING.fullmatch(name) for name in names]
    columns = tuple(Column(m[1], m[2], int(m[3])) for m in matches if m)
    return columns if len(columns) == len(names) and all(each.length for each in columns) else None


def formatter(kind: str) -> Callable[[Any], str]:
    """Return what writes one element of a type other than ``string``."""
    if kind == "bool":
        return lambda value: "true" if value else "false"
    if kind in ("float", "double"):
        return _format_float
    if kind in TYPES:
        return str
    return lambda value: value if isinstance(value, str) else UNKNOWN_ITEM


def parse_cell(column: Column, text: str) -> list[Value]:
    """Return the elements that are in a cell that :attr:`Column.cell` matches; the text of a string."""
    if column.is_string:
        return [text]
    parts = text.split(", ")
    if column.type == "bool":
        return [part == "true" for part in parts]
    if column.type in ("float", "double"):
        return [float(part) for part in parts]
    return [int(part) for part in parts] if column.type in TYPES else list(parts)


def _format_float(value: float) -> str:
    """Return a number as C prints it, which prints the sign of a NaN, too."""
    return "-nan" if math.isnan(value) and math.copysign(1, value) < 0 else f"{value:f}"
