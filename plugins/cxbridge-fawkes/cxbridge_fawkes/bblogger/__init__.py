"""Files of Fawkes' bblogger, one per interface, and folders of them."""

from __future__ import annotations

from cxbridge.trace.formats.base import Format
from cxbridge_fawkes.bblogger.header import is_bblogger_start, log_files

FORMATS = (
    Format(
        "bblogger",
        rank=20,
        recognises=lambda _, head: is_bblogger_start(head),
        reader="cxbridge_fawkes.bblogger.reader:BBLoggerFile",
    ),
    Format(
        "bblogger",
        rank=30,
        recognises=lambda path, _: bool(log_files(path)),
        reader="cxbridge_fawkes.bblogger.reader:BBLoggerFolder",
    ),
)
# opens a folder to record into, see cxbridge.trace.formats.registry
RECORDING = f"{__name__}.writer:open_recording"
