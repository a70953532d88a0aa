"""The log on the terminal: to stderr, with colour only on a tty."""

from __future__ import annotations

import io
import sys
from typing import Any

from cxbridge.events import Event, Level, LogLine

_COLOURS = {Level.DEBUG: "2", Level.INFO: "0", Level.WARN: "33", Level.ERROR: "31"}


STDOUT = "stdout"
"""How errors name it."""


def print_anything() -> None:
    """Let stdout take what it cannot encode: what a damaged file holds must not break the output."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


class _NamedStdout(io.FileIO):
    """Where stdout goes: what it refuses is an error that names it, as that of any file does."""

    def write(self, data: Any) -> int:
        """Write; see :class:`io.FileIO`."""
        try:
            return super().write(data)
        except OSError as error:
            error.filename = STDOUT
            raise


def name_stdout() -> None:
    """Let errors of stdout name it: else nobody could tell them from those of a socket."""
    out = sys.stdout
    if not isinstance(out, io.TextIOWrapper):
        return
    if not isinstance(getattr(out.buffer, "raw", out.buffer), io.FileIO):
        return
    raw = _NamedStdout(out.fileno(), "w", closefd=False)
    buffered = isinstance(out.buffer, io.BufferedWriter)  # else PYTHONUNBUFFERED is set
    sys.stdout = io.TextIOWrapper(
        io.BufferedWriter(raw) if buffered else raw,
        out.encoding,
        out.errors,
        line_buffering=out.line_buffering,
        write_through=out.write_through,
    )


class ConsoleLog:
    """Prints log lines to stderr.

    :param quiet: errors only.
    :param verbose: everything; without either, warnings and errors.
    :param info: what is for everybody, too, unless quiet.
    """

    def __init__(self, *, quiet: bool = False, verbose: bool = False, info: bool = False) -> None:
        shown = {Level.ERROR}
        if not quiet:
            shown |= {Level.WARN, Level.INFO} if info else {Level.WARN}
        if verbose:
            shown |= {Level.INFO, Level.DEBUG}
        self._shown = shown
        self._colour = sys.stderr.isatty()

    def __call__(self, event: Event) -> None:
        """Print a log line, if it is to be shown."""
        if not isinstance(event, LogLine) or event.level not in self._shown:
            return
        text = f"{event.level.value} {event.component}: {event.text}"
        if self._colour:
            text = f"\x1b[{_COLOURS[event.level]}m{text}\x1b[0m"
        sys.stderr.write(text.encode("utf-8", "backslashreplace").decode() + "\n")
