"""The CSV files that ``ffbblog convert`` writes, one for each interface, and folders of them."""

from __future__ import annotations

from cxbridge.trace.formats.base import CopyFormat, Format
from cxbridge.trace.formats.csv.columns import csv_files, starts_well

FORMATS = (
    Format(
        "csv",
        40,
        recognises=lambda _, head: starts_well(head),
        reader="cxbridge.trace.formats.csv.reader:CsvFile",
    ),
    Format(
        "csv",
        50,
        recognises=lambda path, _: bool(csv_files(path)),
        reader="cxbridge.trace.formats.csv.reader:CsvFolder",
    ),
)
COPIES = (
    CopyFormat(
        "csv",
        50,
        "cxbridge.trace.formats.csv.writer:CsvWriter",
        exact="cxbridge.trace.formats.csv.writer:convert_bblogger",
    ),
)
