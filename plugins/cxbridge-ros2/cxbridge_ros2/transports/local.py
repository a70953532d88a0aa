"""Nodes within a process: a message waits in the receiver's queue until it is polled, without delay.

Messages are encoded to CDR and decoded again, so that nodes share no objects and invalid messages are found.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from functools import partial
from itertools import count
from typing import Any, Final

from msgspec import Struct

from cxbridge_ros2.definitions import Definitions
from cxbridge_ros2.messages import Codec, Message
from cxbridge_ros2.names import TypeName, parse_type
from cxbridge_ros2.node import AnswerLater, Client, Failed, Node, Publisher, Receive, Report
from cxbridge_ros2.qos import PROFILES, QosProfile
from cxbridge_ros2.topics import check_topic

# the limit stops two nodes that answer each other forever; otherwise the clock would never advance
MOST_ROUNDS: Final = 10_000


class _Reader(Struct, eq=False):
    node: LocalNode
    kind: TypeName
    receive: Receive


class _Server(Struct, eq=False):
    node: LocalNode
    kind: TypeName
    answer: AnswerLater
    number: int


class LocalGraph:
    """The nodes of a process that reach each other."""

    def __init__(self, definitions: Definitions) -> None:
        self.codec = Codec(definitions)
        self.readers: dict[str, list[_Reader]] = {}
        self.servers: dict[str, _Server] = {}
        # Last messages of latched topics, for late subscriptions.
        self.kept: dict[str, deque[tuple[TypeName, bytes]]] = {}
        self.numbers = count(1)
        self._nodes: list[LocalNode] = []

    @property
    def nodes(self) -> tuple[str, ...]:
        return tuple(node.name for node in self._nodes)

    def join(self, name: str, report: Report | None = None) -> LocalNode:
        node = LocalNode(self, name, report)
        self._nodes.append(node)
        return node

    def leave(self, node: LocalNode) -> None:
        """Remove a node with its subscriptions and services."""
        if node in self._nodes:
            self._nodes.remove(node)
        for readers in self.readers.values():
            readers[:] = [each for each in readers if each.node is not node]
        self.servers = {name: each for name, each in self.servers.items() if each.node is not node}

    def settle(self) -> bool:
        """Poll all nodes until no messages are left; return whether none are left."""
        for _ in range(MOST_ROUNDS):
            handled = [node.poll() for node in list(self._nodes)]
            if not any(handled):
                return True
        return False


class LocalNode(Node):
    def __init__(self, graph: LocalGraph, name: str, report: Report | None = None) -> None:
        super().__init__(report)
        self.name = name
        self.graph = graph
        self.queue: deque[Callable[[], None]] = deque()

    def publisher(self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]) -> Publisher:
        kind = parse_type(message_type)
        self.graph.codec.encode(kind, {})  # checks that the type exists
        return _LocalPublisher(self.graph, check_topic(topic), kind, qos)

    def _subscribe(
        self, topic: str, message_type: str, receive: Receive, qos: QosProfile
    ) -> Callable[[], None]:
        kind = parse_type(message_type)
        self.graph.codec.encode(kind, {})
        reader = _Reader(self, kind, receive)
        readers = self.graph.readers.setdefault(check_topic(topic), [])
        readers.append(reader)
        if qos.durability == "transient_local":
            for sent, data in self.graph.kept.get(topic, ()):
                self.take(topic, reader, sent, data)

        def end() -> None:
            if reader in readers:
                readers.remove(reader)

        return end

    def take(self, topic: str, reader: _Reader, kind: TypeName, data: bytes) -> None:
        """Queue a message for a subscription until this node is polled."""
        if kind != reader.kind:
            self.complain(f"type {topic}", f"{topic}: {kind} comes, {reader.kind} is wanted")
            return

        def deliver() -> None:
            if reader in self.graph.readers[topic]:  # the subscription may have ended meanwhile
                reader.receive(self.graph.codec.decode(kind, data))

        self.queue.append(deliver)

    def client(self, service: str, service_type: str) -> Client:
        kind = parse_type(service_type, "srv")
        self.graph.codec.encode(kind.derived("Request"), {})
        return _LocalClient(self, check_topic(service), kind)

    def _serve_later(self, service: str, service_type: str, answer: AnswerLater) -> Callable[[], None]:
        kind = parse_type(service_type, "srv")
        self.graph.codec.encode(kind.derived("Request"), {})
        server = _Server(self, kind, answer, next(self.graph.numbers))
        self.graph.servers[check_topic(service)] = server

        def end() -> None:
            if self.graph.servers.get(service) is server:
                del self.graph.servers[service]

        return end

    def poll(self, timeout_s: float = 0.0) -> bool:  # noqa: ARG002 - a wait would receive nothing
        remaining = len(self.queue)
        for _ in range(remaining):
            self.queue.popleft()()
        return remaining > 0

    def close(self) -> None:
        self.queue.clear()
        self.graph.leave(self)


class _LocalPublisher(Publisher):
    def __init__(self, graph: LocalGraph, topic: str, kind: TypeName, qos: QosProfile) -> None:
        self._graph, self._topic, self._kind = graph, topic, kind
        self._keep = qos.depth if qos.durability == "transient_local" else 0

    def publish(self, message: Mapping[str, Any]) -> None:
        data = self._graph.codec.encode(self._kind, message)
        if self._keep:
            kept = self._graph.kept.setdefault(self._topic, deque(maxlen=self._keep))
            kept.append((self._kind, data))
        for reader in list(self._graph.readers.get(self._topic, ())):
            reader.node.take(self._topic, reader, self._kind, data)

    @property
    def subscriptions(self) -> int:
        return len(self._graph.readers.get(self._topic, ()))

    def close(self) -> None: ...


class _LocalClient(Client):
    def __init__(self, node: LocalNode, service: str, kind: TypeName) -> None:
        self._node, self._service, self._kind = node, service, kind
        self._waiting: dict[int, Receive] = {}
        self._numbers = count(1)

    def call(self, request: Mapping[str, Any], done: Receive, failed: Failed | None = None) -> int:  # noqa: ARG002
        """Send a request; without a server it is lost, as on a network."""
        codec, kind = self._node.graph.codec, self._kind
        number = next(self._numbers)
        self._waiting[number] = done
        sent = codec.decode(kind.derived("Request"), codec.encode(kind.derived("Request"), request))
        server = self._node.graph.servers.get(self._service)
        if server is not None and server.kind == kind:
            server.node.queue.append(partial(self._ask, server, sent, number))
        return number

    def _ask(self, server: _Server, request: Message, number: int) -> None:
        codec, kind = self._node.graph.codec, self._kind.derived("Response")

        def reply(response: Mapping[str, Any]) -> None:
            decoded = codec.decode(kind, codec.encode(kind, response))
            self._node.queue.append(partial(self._answered, number, decoded))

        server.answer(request, reply)

    def _answered(self, number: int, response: Message) -> None:
        done = self._waiting.pop(number, None)
        if done is not None:
            done(response)

    def forget(self, number: int) -> None:
        self._waiting.pop(number, None)

    @property
    def servers(self) -> frozenset[int]:
        server = self._node.graph.servers.get(self._service)
        return frozenset() if server is None or server.kind != self._kind else frozenset({server.number})

    def close(self) -> None:
        self._waiting.clear()
