"""Who is there, by the tokens of liveliness."""

from __future__ import annotations

import threading
from itertools import count
from typing import Final

from cxbridge.ros2.transports.zenoh_names import Kind, Place, endpoint_of

_MOST: Final = 100_000
"""Tokens that are kept: a stranger may send any number."""


class Graph:
    """The endpoints of a domain, each by a number of its own; in any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._there: dict[tuple[Kind, Place], dict[str, int]] = {}
        self._numbers = count(1)
        self._size = 0

    def come(self, token: str) -> None:
        """Note a token; what is none is ignored."""
        found = endpoint_of(token)
        if found is None:
            return
        with self._lock:
            if self._size < _MOST:
                tokens = self._there.setdefault((found.kind, found.place), {})
                self._size += token not in tokens
                tokens.setdefault(token, next(self._numbers))

    def go(self, token: str) -> None:
        """Forget a token."""
        found = endpoint_of(token)
        if found is None:
            return
        with self._lock:
            tokens = self._there.get((found.kind, found.place), {})
            self._size -= tokens.pop(token, None) is not None
            if not tokens:
                self._there.pop((found.kind, found.place), None)

    def at(self, kind: Kind, place: Place) -> frozenset[int]:
        """Return who is at a place now."""
        with self._lock:
            return frozenset(self._there.get((kind, place), {}).values())
