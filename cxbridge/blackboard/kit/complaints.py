"""Log lines about mistakes of peers: each kind once a minute, with the number of omitted lines."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import Final

PAUSE_S: Final = 60.0
"""Seconds before a complaint of the same kind is logged again."""

MAX_KINDS: Final = 1000
"""Kinds of complaints, counted apart; their names may come from the wire."""


class Complaints:
    """Logs the first complaint of a kind, then at most one in :data:`PAUSE_S`. Thread-safe.

    :param log: takes the text.
    """

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log: Final = log
        self._lock = threading.Lock()
        self._logged: dict[str, tuple[float, int]] = {}  # when a kind was logged, and how many came since

    def add(self, kind: str, text: str) -> None:
        """Log ``text`` unless its kind was logged a moment ago.

        :param kind: the key of complaints that count as equal.
        :param text: the description of this mistake.
        """
        now = time.monotonic()
        with self._lock:
            if kind not in self._logged and len(self._logged) >= MAX_KINDS:
                kind = ""
            since, count = self._logged.get(kind, (-PAUSE_S, 0))
            if now - since < PAUSE_S:
                self._logged[kind] = since, count + 1
                return
            self._logged[kind] = now, 0
        self._log(f"{text} ({count} more times since it was told)" if count else text)
