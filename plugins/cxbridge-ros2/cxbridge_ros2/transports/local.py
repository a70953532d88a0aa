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
from cxbridge_ros2.names import TypeName, check_topic, parse_type
from cxbridge_ros2.node import (
    Client,
    FailureCallback,
    MessageCallback,
    Node,
    ProblemCallback,
    Publisher,
    RequestHandler,
)
from cxbridge_ros2.qos import PROFILES, QosProfile

# the limit stops two nodes that answer each other forever; otherwise the clock would never advance
MAX_ROUNDS: Final = 10_000


class _Subscription(Struct, eq=False):
    node: LocalNode
    kind: TypeName
    callback: MessageCallback


class _Server(Struct, eq=False):
    node: LocalNode
    kind: TypeName
    handler: RequestHandler
    number: int


class LocalGraph:
    """The nodes of a process that reach each other."""

    def __init__(self, definitions: Definitions) -> None:
        self.codec = Codec(definitions)
        self.subscriptions: dict[str, list[_Subscription]] = {}
        self.servers: dict[str, _Server] = {}
        # last messages of latched topics, for late subscriptions
        self.latched: dict[str, deque[tuple[TypeName, bytes]]] = {}
        self.numbers = count(1)
        self._nodes: list[LocalNode] = []

    @property
    def nodes(self) -> tuple[str, ...]:
        return tuple(node.name for node in self._nodes)

    def join(self, name: str, report: ProblemCallback | None = None) -> LocalNode:
        node = LocalNode(self, name, report)
        self._nodes.append(node)
        return node

    def leave(self, node: LocalNode) -> None:
        """Remove a node with its subscriptions and services."""
        if node in self._nodes:
            self._nodes.remove(node)
        for subscriptions in self.subscriptions.values():
            subscriptions[:] = [
                subscription for subscription in subscriptions if subscription.node is not node
            ]
        self.servers = {name: server for name, server in self.servers.items() if server.node is not node}

    def settle(self) -> bool:
        """Poll all nodes until no messages are left; return False if the nodes do not stop."""
        for _ in range(MAX_ROUNDS):
            # a list, since any() of a generator would stop at the first node that had a message
            handled = [node.poll() for node in list(self._nodes)]
            if not any(handled):
                return True
        return False


class LocalNode(Node):
    """A node of this process."""

    def __init__(self, graph: LocalGraph, name: str, report: ProblemCallback | None = None) -> None:
        super().__init__(report)
        self.name = name
        self.graph = graph
        self.queue: deque[Callable[[], None]] = deque()

    def _topic_type(self, message_type: str) -> TypeName:
        kind = parse_type(message_type)
        self.graph.codec.encode(kind, {})  # raises the error about an unknown type
        return kind

    def _service_type(self, service_type: str) -> TypeName:
        kind = parse_type(service_type, "srv")
        self.graph.codec.encode(kind.derive("Request"), {})
        return kind

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        graph, kind = self.graph, self._topic_type(message_type)
        check_topic(topic)

        def publish(message: Mapping[str, Any]) -> None:
            data = graph.codec.encode(kind, message)
            if qos.durability == "transient_local":
                graph.latched.setdefault(topic, deque(maxlen=qos.depth)).append((kind, data))
            for subscription in list(graph.subscriptions.get(topic, ())):
                subscription.node.enqueue(topic, subscription, kind, data)

        return Publisher(publish, lambda: len(graph.subscriptions.get(topic, ())), lambda: None)

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        subscription = _Subscription(self, self._topic_type(message_type), callback)
        subscriptions = self.graph.subscriptions.setdefault(check_topic(topic), [])
        subscriptions.append(subscription)
        if qos.durability == "transient_local":
            for kind, data in self.graph.latched.get(topic, ()):
                self.enqueue(topic, subscription, kind, data)

        def end() -> None:
            if subscription in subscriptions:
                subscriptions.remove(subscription)

        return end

    def enqueue(self, topic: str, subscription: _Subscription, kind: TypeName, data: bytes) -> None:
        """Queue a message for a subscription until this node is polled."""
        if kind != subscription.kind:
            self.complain(f"type {topic}", f"{topic}: {kind} comes, {subscription.kind} is wanted")
            return

        def deliver() -> None:
            if subscription in self.graph.subscriptions[topic]:  # the subscription may have ended meanwhile
                subscription.callback(self.graph.codec.decode(kind, data))

        self.queue.append(deliver)

    def create_client(self, service: str, service_type: str) -> Client:
        return _LocalClient(self, check_topic(service), self._service_type(service_type))

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        server = _Server(self, self._service_type(service_type), handler, next(self.graph.numbers))
        self.graph.servers[check_topic(service)] = server

        def end() -> None:
            if self.graph.servers.get(service) is server:
                del self.graph.servers[service]

        return end

    def poll(self, timeout_s: float = 0.0) -> bool:  # noqa: ARG002 - a wait would receive nothing
        # messages that callbacks queue meanwhile belong to the next poll
        queued = len(self.queue)
        for _ in range(queued):
            self.queue.popleft()()
        return queued > 0

    def close(self) -> None:
        self.queue.clear()
        self.graph.leave(self)


class _LocalClient(Client):
    def __init__(self, node: LocalNode, service: str, kind: TypeName) -> None:
        super().__init__()
        self._node, self._service, self._kind = node, service, kind

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        """Send a request; without a server it is lost, as on a network."""
        number = self._register_request(on_response, on_failure)
        sent = self._transfer("Request", request)
        server = self._server
        if server is not None:
            server.node.queue.append(partial(self._handle, server, sent, number))
        return number

    def _transfer(self, part: str, message: Mapping[str, Any]) -> Message:
        """Return a message as the other node receives it."""
        codec, kind = self._node.graph.codec, self._kind.derive(part)
        return codec.decode(kind, codec.encode(kind, message))

    def _handle(self, server: _Server, request: Message, number: int) -> None:
        def reply(response: Mapping[str, Any]) -> None:
            self._node.queue.append(partial(self._finish, number, self._transfer("Response", response)))

        server.handler(request, reply)

    def _finish(self, number: int, response: Message) -> None:
        if number in self._pending_callbacks:
            on_response, _failed = self._pending_callbacks.pop(number)
            on_response(response)

    @property
    def _server(self) -> _Server | None:
        server = self._node.graph.servers.get(self._service)
        return None if server is None or server.kind != self._kind else server

    @property
    def server_numbers(self) -> frozenset[int]:
        return frozenset() if self._server is None else frozenset({self._server.number})

    def close(self) -> None:
        self._pending_callbacks.clear()
