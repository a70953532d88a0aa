"""The graph of a domain, built from liveliness tokens."""

from __future__ import annotations

import threading
from itertools import count
from typing import Final

from cxbridge_ros2.names import TypeName
from cxbridge_ros2.transports.misfits import whole_name, why_unserved
from cxbridge_ros2.transports.zenoh.names import Kind, TypedName, endpoint_of

_MOST: Final = 100_000  # limit of stored tokens: a stranger may send any number


class RosGraph:
    """The endpoints of a domain, each with a unique number. Thread-safe."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._tokens: dict[tuple[Kind, TypedName], dict[str, int]] = {}
        self._numbers = count(1)
        self._size = 0
        self.version = 0  # incremented by each change

    def add(self, token: str) -> None:
        """Add a token; invalid tokens are ignored."""
        endpoint = endpoint_of(token)
        if endpoint is None:
            return
        with self._lock:
            if self._size < _MOST:
                self.version += 1
                tokens = self._tokens.setdefault((endpoint.kind, endpoint.place), {})
                self._size += token not in tokens
                tokens.setdefault(token, next(self._numbers))

    def remove(self, token: str) -> None:
        endpoint = endpoint_of(token)
        if endpoint is None:
            return
        with self._lock:
            tokens = self._tokens.get((endpoint.kind, endpoint.place), {})
            self._size -= tokens.pop(token, None) is not None
            if not tokens:
                self._tokens.pop((endpoint.kind, endpoint.place), None)

    def called(self, kind: Kind, name: str) -> list[TypedName]:
        """Return the places with a name, one for each type in use."""
        with self._lock:
            return [place for known, place in self._tokens if known == kind and place.name == name]

    def why_unserved(self, place: TypedName, kind: TypeName, where: str) -> str:
        """Return why a service has no server; see :func:`.misfits.why_unserved`."""
        with self._lock:
            served = {whole_name(each.name): each.kind for known, each in self._tokens if known == "SS"}
            # our own endpoints are in the table, too
            sessions = {token.split("/")[2] for tokens in self._tokens.values() for token in tokens}
        return why_unserved(whole_name(place.name), kind, served, "" if len(sessions) > 1 else where)

    def at(self, kind: Kind, place: TypedName) -> frozenset[int]:
        with self._lock:
            return frozenset(self._tokens.get((kind, place), {}).values())
