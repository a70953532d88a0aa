"""The output of the program: results on stdout, the log on stderr.

Nearly all output contains foreign text, whose control characters are escaped. :func:`say` prints one line of
such text, :func:`say_json` prints JSON, and :func:`say_text` text of several lines.
:class:`~cxbridge.printing.VisibleStream` filters everything else, such as tracebacks. Only the colours and
cursor movements of this module and of :mod:`cxbridge.cli.run_output` pass unfiltered.
"""

from __future__ import annotations

import io
import json
import sys
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final

import typer

from cxbridge.errors import CxbridgeError
from cxbridge.events import Event, Level, LogLine
from cxbridge.file_access import make_parent_folder
from cxbridge.printing import VisibleStream, indent_lines, one_line, unfiltered_stream, visible

# Endless rules print a hundred thousand equal lines at one moment of a virtual clock.
_MAX_EQUAL_LINES: Final = 3

# The gap between two lines that ends a moment, in microseconds of the run's clock: less than a cycle, so that
# the lines of two cycles are counted separately.
_MOMENT_GAP_US: Final = 10_000

# The limit of remembered lines of one moment, which bounds the memory.
_MAX_COUNTED_LINES: Final = 10_000

# SGR parameters of ANSI escape sequences: dim, default, yellow, red.
_COLOURS = {Level.DEBUG: "2", Level.INFO: "0", Level.WARN: "33", Level.ERROR: "31"}


def guard_streams() -> None:
    """Make stdout and stderr accept any text and filter control sequences; further calls do nothing."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
        if stream is not None and not isinstance(stream, VisibleStream):
            setattr(sys, name, VisibleStream(stream))


def say(text: object, *, err: bool = False, flush: bool = False) -> None:
    """Print a text as one line, with control characters escaped."""
    print(one_line(str(text)), file=sys.stderr if err else sys.stdout, flush=flush)


def say_text(text: str, *, err: bool = False, end: str = "\n") -> None:
    """Print a text of several lines, with other control characters escaped."""
    print(visible(text), file=sys.stderr if err else sys.stdout, end=end)


def say_lines(lines: Iterable[object]) -> None:
    """Print each text as one line, with control characters escaped."""
    for line in lines:
        say(line)


def say_json(value: Any, *, indent: int | None = None, flush: bool = False) -> None:
    """Print a value as JSON, with control characters escaped."""
    print(visible(json.dumps(value, indent=indent, ensure_ascii=False)), flush=flush)


def say_result(result: Any, lines: Iterable[object], *, as_json: bool, indent: int | None = 2) -> None:
    """Print the result of a command.

    :param result: the result for ``--json``.
    :param lines: the result for people.
    """
    if as_json:
        say_json(result, indent=indent)
    else:
        say_lines(lines)


def complain(text: object) -> None:
    """Print an error to stderr, with all lines but the first one indented."""
    print(f"cxbridge: error: {indent_lines(str(text))}", file=sys.stderr)


@contextmanager
def progress_line(*, hidden: bool = False) -> Iterator[Callable[[str], None]]:
    """Yield a function that shows the progress of work on one line of the terminal; the line ends empty.

    Without a terminal on stderr, or if hidden, the function does nothing.
    """
    if hidden or not sys.stderr.isatty():
        yield lambda _text: None
        return
    stream = unfiltered_stream(sys.stderr)

    def show(text: str) -> None:
        # the cursor stays at the start of the line, so that the next line of the log replaces the progress
        stream.write(f"\r\x1b[K{one_line(text)}\r")
        stream.flush()

    try:
        yield show
    finally:
        show("")


STDOUT = "stdout"
"""The name of stdout in errors."""


class _NamedStdout(io.FileIO):
    """Stdout as a file whose errors contain its name."""

    def write(self, data: Any) -> int:
        try:
            return super().write(data)
        except OSError as error:
            error.filename = STDOUT
            raise


def name_stdout() -> None:
    """Make errors of stdout contain its name, without which they look like errors of a socket."""
    out = sys.stdout
    # any other object is the stream of a test or of an embedding program, and stays
    if isinstance(out, io.TextIOWrapper) and isinstance(getattr(out.buffer, "raw", out.buffer), io.FileIO):
        raw = _NamedStdout(out.fileno(), "w", closefd=False)
        sys.stdout = io.TextIOWrapper(
            # PYTHONUNBUFFERED removes the buffer
            io.BufferedWriter(raw) if isinstance(out.buffer, io.BufferedWriter) else raw,
            out.encoding,
            out.errors,
            line_buffering=out.line_buffering,
            write_through=out.write_through,
        )


class ConsoleLog:
    """Prints log lines to stderr, in colour on a terminal.

    By default, warnings and errors are printed.

    :param quiet: whether to print errors only.
    :param verbose: whether to print all lines, even with ``quiet``.
    :param info: whether to include lines of the level INFO, unless quiet.
    """

    def __init__(self, *, quiet: bool = False, verbose: bool = False, info: bool = False) -> None:
        self._quiet = quiet
        self._levels = {Level.ERROR}
        if not quiet:
            self._levels |= {Level.WARN, Level.INFO} if info else {Level.WARN}
        if verbose:
            self._levels = set(Level)
        self._has_colour = sys.stderr.isatty()
        # the numbers of equal lines of this moment, by level, component and text
        self._equal_counts: Counter[tuple[Level, str, str]] = Counter()
        self._last_time_us = 0  # the time of the last line

    def __call__(self, event: Event) -> None:
        """Print a log line if its level is shown; equal lines at one moment are limited."""
        if not isinstance(event, LogLine) or event.level not in self._levels:
            return
        if (
            event.time_us - self._last_time_us > _MOMENT_GAP_US
            or len(self._equal_counts) > _MAX_COUNTED_LINES
        ):
            self.finish()
        self._last_time_us = event.time_us
        level_component_text = event.level, event.component, event.text
        self._equal_counts[level_component_text] += 1
        if self._equal_counts[level_component_text] <= _MAX_EQUAL_LINES:
            self._print(*level_component_text)

    def show_info(self) -> None:
        """Include lines of the level INFO, unless quiet."""
        if not self._quiet:
            self._levels.add(Level.INFO)

    def finish(self) -> None:
        """Print how many equal lines were omitted, and reset the counts."""
        for (level, component, text), count in self._equal_counts.items():
            if count > _MAX_EQUAL_LINES:
                self._print(level, component, f"{text} ... repeated {count - _MAX_EQUAL_LINES:,} times")
        self._equal_counts.clear()

    def _print(self, level: Level, component: str, text: str) -> None:
        line = f"{level.value} {one_line(component)}: {indent_lines(text)}"
        if self._has_colour:
            line = f"\x1b[{_COLOURS[level]}m{line}\x1b[0m"
        unfiltered_stream(sys.stderr).write(f"{line}\n")


@dataclass(frozen=True, kw_only=True)
class ConsoleOptions:
    """The options of commands for the amount of log output on stderr."""

    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Log errors only.")] = False
    verbose: Annotated[bool, typer.Option("--verbose", "-v", help="Log everything.")] = False

    def make_log(self, *, info: bool = False) -> ConsoleLog:
        """Return a printer of log lines.

        :param info: whether to print lines of the level INFO by default, as services do.
        """
        return ConsoleLog(quiet=self.quiet, verbose=self.verbose, info=info)


def make_output_folders(*files: Path | None) -> None:
    """Make the folders of output files, before long work.

    :raises CxbridgeError: if a folder cannot be made, or a path is a folder.
    """
    for file in files:
        if file is not None and make_parent_folder(file).is_dir():
            raise CxbridgeError("cannot be written: it is a folder", file=file, hint="name a file")


def local_time(time_us: int) -> str:
    """Return a time stamp as local time: ``never`` for 0, the number of microseconds if the time is invalid.

    :param time_us: microseconds since the epoch.
    """
    from datetime import UTC, datetime

    if not time_us:
        return "never"
    try:
        return datetime.fromtimestamp(time_us / 1e6, UTC).astimezone().strftime("%Y-%m-%d %H:%M:%S.%f")
    except (ValueError, OverflowError, OSError):  # a writer may set any time stamp
        return f"{time_us} us"
