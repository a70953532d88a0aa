"""Log lines about mistakes of peers, each kind at most once a minute."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

PAUSE_S: Final = 60.0
"""The seconds between log lines about mistakes of the same kind."""

# the names of kinds may come from the wire: the table must not grow without limit
MAX_KINDS: Final = 1000
"""The maximal number of kinds with a separate pause."""


class Complaints:
    """Logs the first complaint of a kind, then at most one in `PAUSE_S`. Thread-safe."""

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log: Final = log
        self._lock = threading.Lock()
        # time of the last log line of a kind, and number of complaints since
        self._logged: dict[str, tuple[float, int]] = {}

    def add(self, kind: str, text: str) -> None:
        """Log ``text`` unless a complaint of its kind was logged within the pause."""
        now = time.monotonic()
        with self._lock:
            if kind not in self._logged and len(self._logged) >= MAX_KINDS:
                kind = ""  # all further kinds share one pause
            since, count = self._logged.get(kind, (-PAUSE_S, 0))
            if now - since < PAUSE_S:
                self._logged[kind] = since, count + 1
                return
            self._logged[kind] = now, 0
        self._log(f"{text} ({count} more times since the last line)" if count else text)
