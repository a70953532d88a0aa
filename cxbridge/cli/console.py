"""The log on the terminal: to stderr, with colour only on a tty."""

from __future__ import annotations

import io
import sys

from cxbridge.events import Event, Level, LogLine

_COLOURS = {Level.DEBUG: "2", Level.INFO: "0", Level.WARN: "33", Level.ERROR: "31"}


def print_anything() -> None:
    """Let stdout take what it cannot encode: what a damaged file holds must not break the output."""
    if isinstance(sys.stdout, io.TextIOWrapper):
        sys.stdout.reconfigure(errors="backslashreplace")


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
