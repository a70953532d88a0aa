"""The graph of a domain, by the tokens of liveliness."""

from __future__ import annotations

import threading
from itertools import count
from typing import Final

from cxbridge_ros2.names import TypeName
from cxbridge_ros2.transports.misfits import whole_name, why_unserved
from cxbridge_ros2.transports.zenoh.names import Kind, TypedName, endpoint_of

_MOST: Final = 100_000
"""Tokens that are kept: a stranger may send any number."""


class RosGraph:
    """The endpoints of a domain, each by a unique number; in any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._there: dict[tuple[Kind, TypedName], dict[str, int]] = {}
        self._numbers = count(1)
        self._size = 0
        self.version = 0
        """Another number after each change."""

    def come(self, token: str) -> None:
        """Add a token; an invalid one is ignored."""
        found = endpoint_of(token)
        if found is None:
            return
        with self._lock:
            if self._size < _MOST:
                self.version += 1
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

    def called(self, kind: Kind, name: str) -> list[TypedName]:
        """Return the places of a name, one for each type that endpoints use there."""
        with self._lock:
            return [place for known, place in self._there if known == kind and place.name == name]

    def why_unserved(self, place: TypedName, kind: TypeName, where: str) -> str:
        """Return why a service has no server; see :func:`.misfits.why_unserved`."""
        with self._lock:
            served = {whole_name(each.name): each.kind for known, each in self._there if known == "SS"}
            # our own endpoints are in the table, too
            sessions = {token.split("/")[2] for tokens in self._there.values() for token in tokens}
        return why_unserved(whole_name(place.name), kind, served, "" if len(sessions) > 1 else where)

    def at(self, kind: Kind, place: TypedName) -> frozenset[int]:
        """Return who is at a place now."""
        with self._lock:
            return frozenset(self._there.get((kind, place), {}).values())
