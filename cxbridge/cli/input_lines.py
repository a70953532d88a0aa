"""Lines from a terminal or a pipe.

A wait for input also ends when the caller's function ``is_done`` returns True, for example after a signal.
"""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from typing import Final, TextIO

_POLL_S: Final = 0.2  # seconds between calls of ``is_done`` without input
_CHUNK_BYTES: Final = 4096  # of one read
_MAX_LINE_BYTES: Final = 65_536  # a longer line is split, since the input may have no line feeds


class InputLines:
    """Reads lines; a wait for input can be ended.

    :param stream: a file or a terminal; by default stdin.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        # sys.stdin is None if it was closed, which counts as the end of input
        self._stream: TextIO | None = sys.stdin if stream is None else stream
        self._buffer = b""
        self._has_ended = self._stream is None

    @property
    def is_terminal(self) -> bool:
        return self._stream is not None and self._stream.isatty()

    def next(self, is_done: Callable[[], bool]) -> str | None:
        """Return the next line, stripped; None at the end of input, or when ``is_done`` returns True."""
        while not is_done():
            line, line_feed, remainder = self._buffer.partition(b"\n")
            if line_feed or (self._has_ended and line) or len(line) > _MAX_LINE_BYTES:
                self._buffer = remainder
                return line.decode("utf-8", "replace").strip()
            if self._has_ended:
                return None
            self._read(_CHUNK_BYTES)
        return None

    def _read(self, size: int) -> None:
        """Add at most ``size`` bytes to the buffer, or return after `_POLL_S` without input."""
        assert self._stream is not None
        # select instead of a blocking read, because ``is_done`` may end the wait at any time
        ready, _, _ = select.select([self._stream], [], [], _POLL_S)
        if ready:
            received_bytes = os.read(self._stream.fileno(), size)
            self._buffer += received_bytes
            self._has_ended = not received_bytes
