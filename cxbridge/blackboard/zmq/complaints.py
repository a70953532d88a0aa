"""Says once what happens a thousand times."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

PAUSE: Final = 60.0
"""Seconds before the same complaint is made again, with the number of those in between."""

MAX_KINDS: Final = 64
"""Different complaints that are told apart."""


class Complaints:
    """Log lines about others' mistakes, each kind at most once in :data:`PAUSE`.

    :param log: takes a line.
    :param now: seconds, monotonic.
    """

    def __init__(self, log: Callable[[str], None], now: Callable[[], float]) -> None:
        self._log = log
        self._now = now
        self._seen: dict[str, tuple[float, int]] = {}

    def make(self, kind: str, text: str) -> None:
        """Log ``text`` unless its kind was logged a moment ago."""
        now = self._now()
        if kind not in self._seen and len(self._seen) >= MAX_KINDS:
            kind = "other"
        since, count = self._seen.get(kind, (-PAUSE, 0))
        if now - since < PAUSE:
            self._seen[kind] = (since, count + 1)
        else:
            self._seen[kind] = (now, 0)
            self._log(f"{text} ({count} more like this in between)" if count else text)
