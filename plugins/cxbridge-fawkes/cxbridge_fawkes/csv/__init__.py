"""The CSV files of Fawkes' ``ffbblog convert``, one per interface.

CSV files are written and not read: without quoting, a text with semicolons looks like two texts.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final, NoReturn

from cxbridge.errors import TraceError
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import CopyFormat, Format
from cxbridge_fawkes.folders import files_with_start

TITLE: Final = "# Time relative to beginning (in sec)"
"""The title of the first column, with which each file starts."""


def refuse_csv(path: Path, _registry: InterfaceRegistry | None) -> NoReturn:
    """Refuse to read a CSV file or a folder of them.

    :raises TraceError: always.
    """
    raise TraceError(
        "CSV can be written, but not read: nothing in it is quoted, so texts with semicolons are lost",
        file=path,
        hint="give the bblogger file (.log) or the recording from which it was made",
    )


def _is_csv_start(head: bytes) -> bool:
    """Return whether a file with these first bytes is a CSV file of this format."""
    title = TITLE.encode()
    return head.startswith((title + b";", title + b"\n"))


FORMATS = (
    Format(
        "csv",
        rank=50,
        recognises=lambda path, head: (
            _is_csv_start(head) or bool(files_with_start(path, "*.csv", len(TITLE) + 1, _is_csv_start))
        ),
        reader=f"{__name__}:refuse_csv",
    ),
)
COPIES = (
    CopyFormat(
        "csv",
        rank=50,
        writer=f"{__name__}.writer:CsvWriter",
        exact=f"{__name__}.writer:convert_bblogger",
    ),
)
