"""Complaints about what comes from the wire: told once, not a thousand times."""

from __future__ import annotations

import threading
from collections import Counter
from collections.abc import Callable
from typing import Final

_MAX_KINDS: Final = 1000


class Complaints:
    """Logs the first complaint of a kind, then the 10th, the 100th, ... with their number.

    :param log: takes the text.
    """

    def __init__(self, log: Callable[[str], None]) -> None:
        self._log: Final = log
        self._counts: Counter[str] = Counter()
        self._lock = threading.Lock()

    def add(self, kind: str, text: str) -> None:
        """Complain.

        :param kind: what complaints have in common that count as the same.
        :param text: what is wrong this time.
        """
        with self._lock:
            if kind not in self._counts and len(self._counts) >= _MAX_KINDS:
                kind = ""  # the rest counts as one kind: their names may come from the wire
            self._counts[kind] += 1
            count = self._counts[kind]
        if count == 1:
            self._log(text)
        elif count >= 10 and str(count).strip("0") == "1":  # noqa: PLR2004 - powers of ten
            self._log(f"{text} ({count} times so far)")
