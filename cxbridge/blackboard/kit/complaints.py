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
        # the time of the last log line, and the number of suppressed complaints since then
        self._history_by_kind: dict[str, tuple[float, int]] = {}

    def add(self, kind: str, text: str) -> None:
        """Log ``text``, or count it if a complaint of its kind was logged within the pause."""
        now_s = time.monotonic()
        with self._lock:
            if kind not in self._history_by_kind and len(self._history_by_kind) >= MAX_KINDS:
                kind = ""  # all further kinds share one pause
            last_s, suppressed_count = self._history_by_kind.get(kind, (-PAUSE_S, 0))
            if now_s - last_s < PAUSE_S:
                self._history_by_kind[kind] = last_s, suppressed_count + 1
                return
            self._history_by_kind[kind] = now_s, 0
        self._log(f"{text} ({suppressed_count} more times since the last line)" if suppressed_count else text)
