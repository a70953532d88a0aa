"""Keys of a terminal, or lines of a pipe, each a step."""

from __future__ import annotations

import os
import select
import sys
from collections.abc import Callable
from types import TracebackType
from typing import Any, Final, Self, TextIO

from cxbridge.errors import CxbridgeError

_SLICE_S: Final = 0.2  # seconds between calls of ``enough`` while no key comes


class StepKeys:
    """Waits for a key on a terminal, else for a line; a context manager that restores the terminal.

    :param stream: None: stdin.
    """

    def __init__(self, stream: TextIO | None = None) -> None:
        self._fd = (sys.stdin if stream is None else stream).fileno()
        self._on_terminal = os.isatty(self._fd)
        self._before: list[Any] | None = None
        self._left = b""
        self._ended = False

    def __enter__(self) -> Self:
        if sys.platform == "win32":
            raise CxbridgeError(
                "keys are read as on Linux and macOS, which Windows cannot", hint="use --speed, or WSL"
            )
        if self._on_terminal:
            import termios  # noqa: PLC0415 - only where there are terminals
            import tty  # noqa: PLC0415

            self._before = termios.tcgetattr(self._fd)
            tty.setcbreak(self._fd)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._before is not None and sys.platform != "win32":
            import termios  # noqa: PLC0415

            termios.tcsetattr(self._fd, termios.TCSADRAIN, self._before)
            self._before = None

    def __call__(self, enough: Callable[[], bool]) -> bool:
        """Wait for a step; return False at the end of input, after ``q``, or if ``enough`` does."""
        while not enough():
            if (step := self._next_input()) is not None:
                return step
            if self._ended:
                return False
            ready, _, _ = select.select([self._fd], [], [], _SLICE_S)
            if ready:
                data = os.read(self._fd, 1 if self._on_terminal else 4096)
                self._left += data
                self._ended = not data
        return False

    def _next_input(self) -> bool | None:
        """Return whether the next input is a step or a request to end, None without input."""
        if self._on_terminal:
            key, self._left = self._left, b""
            return None if not key else key not in (b"q", b"Q", b"\x04")
        line, end, rest = self._left.partition(b"\n")
        if end or (self._ended and line):
            self._left = rest
            return True
        return None
