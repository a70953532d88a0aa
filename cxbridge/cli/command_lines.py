"""Lines and keys from a terminal or a pipe.

A wait for input also ends when the caller's function ``is_done`` returns True, for example after a signal.
"""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from typing import Any, Final, Self, TextIO

from cxbridge.errors import CxbridgeError

_POLL_S: Final = 0.2  # seconds between calls of ``is_done`` without input
_CHUNK: Final = 4096  # bytes of one read
_MAX_LINE_BYTES: Final = 65_536  # a longer line is split, since the input may have no line feeds
_QUIT_KEYS: Final = (b"q", b"Q", b"\x04")  # the last is Ctrl-D, which does not end the input in cbreak mode


class CommandLines:
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
            line, end, rest = self._buffer.partition(b"\n")
            if end or (self._has_ended and line) or len(line) > _MAX_LINE_BYTES:
                self._buffer = rest
                return line.decode("utf-8", "replace").strip()
            if self._has_ended:
                return None
            self._read(_CHUNK)
        return None

    def _read(self, size: int) -> None:
        """Add at most ``size`` bytes to the buffer, or return after `_POLL_S` without input."""
        assert self._stream is not None
        # select instead of a blocking read, because ``is_done`` may end the wait at any time; on Windows,
        # select accepts only sockets, so StepKeys refuses Windows
        ready, _, _ = select.select([self._stream], [], [], _POLL_S)
        if ready:
            data = os.read(self._stream.fileno(), size)
            self._buffer += data
            self._has_ended = not data


class StepKeys(CommandLines):
    """Reads keys on a terminal, otherwise lines; a context manager that restores the terminal.

    :raises CxbridgeError: on entry, if the system is Windows.
    """

    _terminal_settings: list[Any] | None = None

    def __enter__(self) -> Self:
        if sys.platform == "win32":
            raise CxbridgeError("reading single keys is not supported on Windows", hint="use --speed, or WSL")
        if self.is_terminal:
            import termios
            import tty

            assert self._stream is not None
            self._terminal_settings = termios.tcgetattr(self._stream)
            tty.setcbreak(self._stream)
        return self

    def __exit__(self, *_error: object) -> None:
        if self._terminal_settings is not None and sys.platform != "win32":
            import termios

            assert self._stream is not None
            termios.tcsetattr(self._stream, termios.TCSADRAIN, self._terminal_settings)

    def __call__(self, is_done: Callable[[], bool]) -> bool:
        """Wait for a key or a line; return False at the end of input or ``q``, or if ``is_done`` ends it."""
        if not self.is_terminal:
            return self.next(is_done) is not None
        while not (self._buffer or self._has_ended or is_done()):
            self._read(1)
        key, self._buffer = self._buffer, b""
        return bool(key) and key not in _QUIT_KEYS
