"""The graph of a domain, built from liveliness tokens."""

from __future__ import annotations

import threading
from itertools import count
from typing import Final

from cxbridge_ros2.names import TypeName
from cxbridge_ros2.transports.mismatches import missing_server_reason, public_name
from cxbridge_ros2.transports.zenoh.names import Kind, TypedName, endpoint_in

_MAX_TOKENS: Final = 100_000  # limit of stored tokens: a stranger may send any number


class RosGraph:
    """The endpoints of a domain, each with a unique number.

    Zenoh adds and removes tokens in its own threads, while the node reads them in the polling thread.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._tokens: dict[tuple[Kind, TypedName], dict[str, int]] = {}
        self._numbers = count(1)
        self._size = 0
        self.version = 0  # incremented by each new token

    def add(self, token: str) -> None:
        """Add a token; invalid tokens are ignored."""
        endpoint = endpoint_in(token)
        if endpoint is None:
            return
        with self._lock:
            if self._size < _MAX_TOKENS:
                self.version += 1
                tokens = self._tokens.setdefault(endpoint, {})
                self._size += token not in tokens
                tokens.setdefault(token, next(self._numbers))

    def remove(self, token: str) -> None:
        endpoint = endpoint_in(token)
        if endpoint is None:
            return
        with self._lock:
            tokens = self._tokens.get(endpoint, {})
            self._size -= tokens.pop(token, None) is not None
            if not tokens:
                self._tokens.pop(endpoint, None)

    def topics_named(self, kind: Kind, name: str) -> list[TypedName]:
        """Return the topics or services with a name, one for each type in use."""
        with self._lock:
            return [
                topic for endpoint_kind, topic in self._tokens if endpoint_kind == kind and topic.name == name
            ]

    def missing_server_reason(self, service: TypedName, kind: TypeName, network: str) -> str:
        """Return why a service has no server; see :func:`.mismatches.missing_server_reason`."""
        with self._lock:
            servers = [topic for endpoint_kind, topic in self._tokens if endpoint_kind == "SS"]
            # our own endpoints are in the table, too: with them alone, there is one session
            # the third part of a token names the session
            sessions = {token.split("/")[2] for tokens in self._tokens.values() for token in tokens}
        served = {public_name(topic.name): topic.dds_type for topic in servers}
        return missing_server_reason(
            public_name(service.name), kind, served, "" if len(sessions) > 1 else network
        )

    def endpoints(self, kind: Kind, topic: TypedName) -> frozenset[int]:
        with self._lock:
            return frozenset(self._tokens.get((kind, topic), {}).values())
