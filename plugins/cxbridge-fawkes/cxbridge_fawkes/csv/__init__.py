"""The CSV files of Fawkes' ``ffbblog convert``, one per interface.

CSV files are written and not read: without quoting, a text with semicolons looks like two texts.
"""

from __future__ import annotations

from cxbridge.trace.formats.base import CopyFormat

COPIES = (
    CopyFormat(
        "csv",
        rank=50,
        writer=f"{__name__}.writer:CsvWriter",
        direct_copier=f"{__name__}.writer:convert_bblogger",
    ),
)
