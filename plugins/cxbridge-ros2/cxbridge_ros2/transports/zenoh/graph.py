"""The graph of a domain: its endpoints, known from liveliness tokens.

A liveliness token is a key that Zenoh announces while its session lives. rmw_zenoh_cpp declares a token for
each node, publisher, subscription, server and client.
"""

from __future__ import annotations

import threading
from itertools import count
from typing import Final

from cxbridge_ros2.names import TypeName
from cxbridge_ros2.transports.mismatches import describe_missing_server, find_public_name
from cxbridge_ros2.transports.zenoh.names import EndpointKind, TypedName, parse_token

_MAX_TOKENS: Final = 100_000  # limit of stored tokens, since other sessions may declare any number


class RosGraph:
    """The endpoints of a domain, each with a unique number.

    Threads of Zenoh add and remove tokens, while the node reads the graph in the polling thread.

    :ivar version: incremented by each new token.
    """

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._tokens: dict[tuple[EndpointKind, TypedName], dict[str, int]] = {}
        self._numbers = count(1)
        self._token_count = 0
        self.version = 0

    def add(self, token: str) -> None:
        """Add a token; invalid tokens are ignored."""
        endpoint = parse_token(token)
        if endpoint is None:
            return
        with self._lock:
            if self._token_count < _MAX_TOKENS:
                self.version += 1
                tokens = self._tokens.setdefault(endpoint, {})
                self._token_count += token not in tokens
                tokens.setdefault(token, next(self._numbers))

    def remove(self, token: str) -> None:
        endpoint = parse_token(token)
        if endpoint is None:
            return
        with self._lock:
            tokens = self._tokens.get(endpoint, {})
            self._token_count -= tokens.pop(token, None) is not None
            if not tokens:
                self._tokens.pop(endpoint, None)

    def find_topics(self, kind: EndpointKind, name: str) -> list[TypedName]:
        """Return the topics or services with a name: one for each type that endpoints of the kind have."""
        with self._lock:
            return [
                topic for endpoint_kind, topic in self._tokens if endpoint_kind == kind and topic.name == name
            ]

    def describe_missing_server(self, service: TypedName, client_type: TypeName, network: str) -> str:
        """Return why a service has no server; see :func:`.mismatches.describe_missing_server`."""
        with self._lock:
            servers = [topic for endpoint_kind, topic in self._tokens if endpoint_kind == "SS"]
            # the third part of a token is the session; with one session, there are only our own endpoints
            sessions = {token.split("/")[2] for tokens in self._tokens.values() for token in tokens}
        served_types = {find_public_name(topic.name): topic.dds_type for topic in servers}
        return describe_missing_server(
            find_public_name(service.name), client_type, served_types, "" if len(sessions) > 1 else network
        )

    def find_endpoint_numbers(self, kind: EndpointKind, topic: TypedName) -> frozenset[int]:
        """Return the numbers of the endpoints of a kind that a topic or service has."""
        with self._lock:
            return frozenset(self._tokens.get((kind, topic), {}).values())
