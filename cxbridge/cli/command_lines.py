"""Lines from a terminal or a pipe, read one at a time."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from typing import Final, TextIO

_SLICE_S: Final = 0.2  # seconds between calls of ``enough`` while no line comes
_MOST_BYTES: Final = 65_536  # a longer line is cut, as the input may have no line feeds


class CommandLines:
    """Waits for lines.

    :param stream: a file or terminal; None: stdin.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        found: TextIO | None = sys.stdin if stream is None else stream
        self._stream = found
        self._left = b""
        self._ended = found is None  # stdin is closed

    @property
    def on_terminal(self) -> bool:
        """Whether the lines come from a terminal."""
        return self._stream is not None and self._stream.isatty()

    def next(self, enough: Callable[[], bool]) -> str | None:
        """Return the next line without line feed; None at the end of input, or if ``enough`` returns True."""
        while not enough():
            line, end, rest = self._left.partition(b"\n")
            if end or (self._ended and line) or len(line) > _MOST_BYTES:
                self._left = rest
                return line.decode("utf-8", "replace").strip()
            if self._ended or self._stream is None:
                return None
            ready, _, _ = select.select([self._stream], [], [], _SLICE_S)
            if ready:
                data = os.read(self._stream.fileno(), 4096)
                self._left += data
                self._ended = not data
        return None
