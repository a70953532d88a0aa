"""Log lines about mistakes of peers, at most one a minute for each kind of mistake.

A faulty client may repeat its mistake thousands of times a second, which would fill the disk with log lines.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

PAUSE_S: Final = 60.0
"""The seconds between log lines about mistakes of the same kind."""

# kinds may contain names that a peer sent, so the table needs a limit
MAX_KINDS: Final = 1000
"""The maximum number of kinds with a separate pause."""


class Complaints:
    """Logs the first complaint of a kind, then at most one in `PAUSE_S`. Thread-safe."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log: Final = log
        self._lock = threading.Lock()
        # by kind: the time of the last log line, and the number of suppressed complaints since then
        self._last_lines: dict[str, tuple[float, int]] = {}

    def add(self, kind: str, text: str) -> None:
        """Log ``text``, or count it if a complaint of its kind was logged within the pause."""
        now_s = time.monotonic()
        with self._lock:
            if kind not in self._last_lines and len(self._last_lines) >= MAX_KINDS:
                kind = ""  # all further kinds share one pause
            last_s, count = self._last_lines.get(kind, (-PAUSE_S, 0))
            if now_s - last_s < PAUSE_S:
                self._last_lines[kind] = last_s, count + 1
                return
            self._last_lines[kind] = now_s, 0
        self._log(f"{text} ({count} more times since the last line)" if count else text)
