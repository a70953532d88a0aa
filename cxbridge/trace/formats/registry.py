"""Finds the format of a recorded run by looking at its content, not at its name."""

from __future__ import annotations

import os
import stat
from importlib import import_module
from pathlib import Path

from cxbridge.errors import TraceError
from cxbridge.interfaces.registry import InterfaceRegistry
from cxbridge.trace.formats.base import Run

HEAD_SIZE = 64 * 1024
"""How many bytes of a file the formats get to see when they are asked whether it is theirs."""

READERS: tuple[tuple[str, str], ...] = (
    ("cxbridge.trace.formats.mcap_run", "McapRun"),
    ("cxbridge.trace.formats.bblogger", "BBLoggerFile"),
    ("cxbridge.trace.formats.bblogger", "BBLoggerFolder"),
    ("cxbridge.trace.formats.csv_run", "CsvFile"),
    ("cxbridge.trace.formats.csv_run", "CsvFolder"),
    ("cxbridge.trace.formats.transitions_text", "TransitionsText"),
    ("cxbridge.trace.formats.fawkes_log", "FawkesLog"),
    ("cxbridge.trace.formats.clips_watch", "ClipsWatch"),
)
"""Module and class of every format that can be read, the surest to recognise first. Imported when asked."""


def open_run(path: str | Path, registry: InterfaceRegistry | None = None) -> Run:
    """Open a recorded run of any format.

    :param path: a file, or a folder of bblogger files.
    :param registry: who knows the types of interfaces; by default our own definitions.
    :raises TraceError: when there is nothing at ``path``, or nothing that is a recorded run.
    """
    path = Path(path)
    head = _head(path)
    for module, name in READERS:
        reader: type[Run] = getattr(import_module(module), name)
        if reader.recognises(path, head):
            return reader(path, registry)
    raise TraceError(
        "not a recorded run" if head or path.is_dir() else "the file is empty",
        file=path,
        hint="expected an mcap file, a text log of Fawkes, a transitions text, CLIPS' watch items as text,"
        " bblogger files or their CSV",
    )


def _head(path: Path) -> bytes:
    """Return the start of a file, nothing for a folder."""
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            os.scandir(path).close()  # whether it can be read
            return b""
        if not stat.S_ISREG(mode):
            raise TraceError(
                "this is neither a file nor a folder", file=path, hint="copy it into a file first"
            )
        with path.open("rb") as file:
            return file.read(HEAD_SIZE)
    except OSError as error:
        raise TraceError(f"cannot be read: {error.strerror}", file=path) from error
