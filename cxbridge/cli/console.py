"""The output of the program: results to stdout, the log to stderr, nothing that a terminal would obey.

Nearly all output contains foreign text. :func:`say` prints one line of such text, and so each command does;
JSON goes out by :func:`say_json`, text of several lines by :func:`say_text`. Below them
:class:`~cxbridge.printing.VisibleStream` filters the rest, tracebacks included.
"""

from __future__ import annotations

import io
import json
import re
import sys
from collections import Counter
from pathlib import Path
from typing import Any, Final

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, Level, LogLine
from cxbridge.printing import VisibleStream, indented, one_line, terminal_of, visible

_MOST_ALIKE: Final = 3
"""So often the same line is printed at one moment."""

_MOST_SIMILAR: Final = 1000
"""This many lines of one moment are printed that differ in their numbers only."""

_NUMBER: Final = re.compile(r"\d+")

_MOMENT_US: Final = 10_000
"""Microseconds of the run's clock: less than a loop, so that lines of two loops are not taken together."""

_MOST_COUNTED: Final = 10_000
"""Different lines of one moment that are remembered."""

_COLOURS = {Level.DEBUG: "2", Level.INFO: "0", Level.WARN: "33", Level.ERROR: "31"}


def guard_streams() -> None:
    """Let stdout and stderr take any text, and pass on none that a terminal would obey. Twice is as once."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
        if stream is not None and not isinstance(stream, VisibleStream):
            setattr(sys, name, VisibleStream(stream))


def say(text: object, *, err: bool = False, flush: bool = False) -> None:
    """Print a text as one line, whatever it holds."""
    print(one_line(str(text)), file=sys.stderr if err else sys.stdout, flush=flush)


def say_text(text: str, *, err: bool = False, end: str = "\n") -> None:
    """Print a text of several lines."""
    print(visible(text), file=sys.stderr if err else sys.stdout, end=end)


def say_json(data: Any, *, indent: int | None = None, flush: bool = False) -> None:
    """Print a value as JSON; control characters are in it by their numbers."""
    print(visible(json.dumps(data, indent=indent, ensure_ascii=False)), flush=flush)


def complain(text: object) -> None:
    """Print an error, in lines that can be taken for nothing else."""
    print(f"cxbridge: error: {indented(str(text))}", file=sys.stderr)


STDOUT = "stdout"
"""How errors name it."""


class _NamedStdout(io.FileIO):
    """Stdout as a file: a failed write is an error that names it, as with any file."""

    def write(self, data: Any) -> int:
        """Write; see :class:`io.FileIO`."""
        try:
            return super().write(data)
        except OSError as error:
            error.filename = STDOUT
            raise


def name_stdout() -> None:
    """Let errors of stdout name it: otherwise they look like those of a socket."""
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
    """Prints log lines to stderr, with colour only on a tty.

    :param quiet: errors only.
    :param verbose: everything; without either, warnings and errors.
    :param info: general messages, too, unless quiet.
    """

    def __init__(self, *, quiet: bool = False, verbose: bool = False, info: bool = False) -> None:
        self._quiet = quiet
        shown = {Level.ERROR}
        if not quiet:
            shown |= {Level.WARN, Level.INFO} if info else {Level.WARN}
        if verbose:
            shown |= {Level.INFO, Level.DEBUG}
        self._shown = shown
        self._colour = sys.stderr.isatty()
        self._counts: Counter[tuple[Level, str, str]] = Counter()
        self._similar: Counter[tuple[Level, str, str]] = Counter()
        self._time_us = 0

    def __call__(self, event: Event) -> None:
        """Print a log line, if it is to be shown; the same or a similar one not too often at a moment."""
        if not isinstance(event, LogLine) or event.level not in self._shown:
            return
        if (
            event.time_us - self._time_us > _MOMENT_US
            or max(len(self._counts), len(self._similar)) > _MOST_COUNTED
        ):
            self.finish()
        self._time_us = event.time_us
        line = event.level, event.component, event.text
        if line not in self._counts:
            similar = *line[:2], _NUMBER.sub("#", event.text)
            self._similar[similar] += 1
            if self._similar[similar] > _MOST_SIMILAR:
                return
        self._counts[line] += 1
        if self._counts[line] <= _MOST_ALIKE:
            self._print(*line)

    def show_info(self) -> None:
        """Print lines of the level INFO, too, unless quiet."""
        if not self._quiet:
            self._shown.add(Level.INFO)

    def finish(self) -> None:
        """Say how many lines were not printed: repeated ones, and those with other numbers."""
        for (level, component, text), count in self._counts.items():
            if count > _MOST_ALIKE:
                self._print(level, component, f"{text} ... repeated {count - _MOST_ALIKE:,} times")
        for (level, component, text), count in self._similar.items():
            if count > _MOST_SIMILAR:
                more = f"{count - _MOST_SIMILAR:,} more lines with other numbers"
                self._print(level, component, f"{text} ... {more}")
        self._counts.clear()
        self._similar.clear()

    def _print(self, level: Level, component: str, said: str) -> None:
        text = f"{level.value} {one_line(component)}: {indented(said)}"
        if self._colour:
            text = f"\x1b[{_COLOURS[level]}m{text}\x1b[0m"
        terminal_of(sys.stderr).write(f"{text}\n")


def check_folders(*files: Path | None) -> None:
    """See that files can be written later on, before long work.

    :raises CxbridgeError: when the folder of one does not exist, or one is a folder.
    """
    for file in files:
        if file is not None and not file.parent.is_dir():
            raise CxbridgeError(
                "cannot be written: there is no such folder", file=file, hint=f"mkdir -p {file.parent}"
            )
        if file is not None and file.is_dir():
            raise CxbridgeError("cannot be written: it is a folder", file=file, hint="name a file")


def local_time(time_us: int) -> str:
    """Return a time stamp as local time; ``never`` when there was no write."""
    from datetime import UTC, datetime

    if not time_us:
        return "never"
    try:
        return datetime.fromtimestamp(time_us / 1e6, UTC).astimezone().strftime("%Y-%m-%d %H:%M:%S.%f")
    except (ValueError, OverflowError, OSError):  # a writer may stamp as it likes
        return f"{time_us} us"
