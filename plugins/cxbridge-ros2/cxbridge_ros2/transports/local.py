"""Nodes that reach only the other nodes of this process, for agents without a network and for tests.

A message waits in the queue of the receiving node until the node is polled. Messages are encoded to CDR and
decoded again, so that nodes share no objects, and invalid messages are errors as over a network.
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
from cxbridge_ros2.names import TypeName, check_ros_name, parse_type
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

# Limit for nodes that respond to each other forever: the clock would never advance.
# The number is chosen freely.
MAX_SETTLING_ROUNDS: Final = 10_000


class _Subscription(Struct, eq=False):
    node: LocalNode
    type_name: TypeName
    callback: MessageCallback


class _Server(Struct, eq=False):
    node: LocalNode
    type_name: TypeName
    handler: RequestHandler
    number: int


class LocalGraph:
    """A group of nodes that reach each other, with their subscriptions and services."""

    def __init__(self, definitions: Definitions) -> None:
        self.codec = Codec(definitions)
        self.subscriptions: dict[str, list[_Subscription]] = {}
        self.servers: dict[str, _Server] = {}
        # the last messages of topics with transient-local durability, for late subscriptions
        self.latched_messages: dict[str, deque[tuple[TypeName, bytes]]] = {}
        self.server_numbers = count(1)  # a new server gets the next number
        self._nodes: list[LocalNode] = []

    @property
    def node_names(self) -> tuple[str, ...]:
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
        for _ in range(MAX_SETTLING_ROUNDS):
            # a list, since any() of a generator would stop polling at the first node with a message
            were_messages_handled = [node.poll() for node in list(self._nodes)]
            if not any(were_messages_handled):
                return True
        return False


class LocalNode(Node):
    """A node that reaches the nodes of its graph."""

    def __init__(self, graph: LocalGraph, name: str, report: ProblemCallback | None = None) -> None:
        super().__init__(report)
        self.name = name
        self.graph = graph
        self.deliveries: deque[Callable[[], None]] = deque()  # called by the next poll

    def _parse_type(self, name: str, kind: str) -> TypeName:
        """Parse the name of a known message or service; see :func:`.names.parse_type`."""
        type_name = parse_type(name, kind)
        # raises the error about an unknown type
        self.graph.codec.encode(type_name if kind == "msg" else type_name.derive("Request"), {})
        return type_name

    def create_publisher(
        self, topic: str, message_type: str, qos: QosProfile = PROFILES["default"]
    ) -> Publisher:
        graph, type_name = self.graph, self._parse_type(message_type, "msg")
        check_ros_name(topic)

        def publish(message: Mapping[str, Any]) -> None:
            encoded_message = graph.codec.encode(type_name, message)
            if qos.durability == "transient_local":
                latched_messages = graph.latched_messages.setdefault(topic, deque(maxlen=qos.depth))
                latched_messages.append((type_name, encoded_message))
            for subscription in list(graph.subscriptions.get(topic, ())):
                subscription.node.queue_message(topic, subscription, type_name, encoded_message)

        # closing does nothing, since the graph does not record publishers
        return Publisher(publish, lambda: len(graph.subscriptions.get(topic, ())), lambda: None)

    def _subscribe(
        self, topic: str, message_type: str, callback: MessageCallback, qos: QosProfile
    ) -> Callable[[], None]:
        subscription = _Subscription(self, self._parse_type(message_type, "msg"), callback)
        subscriptions = self.graph.subscriptions.setdefault(check_ros_name(topic), [])
        subscriptions.append(subscription)
        if qos.durability == "transient_local":
            for type_name, encoded_message in self.graph.latched_messages.get(topic, ()):
                self.queue_message(topic, subscription, type_name, encoded_message)

        def end_subscription() -> None:
            if subscription in subscriptions:
                subscriptions.remove(subscription)

        return end_subscription

    def queue_message(
        self, topic: str, subscription: _Subscription, type_name: TypeName, encoded_message: bytes
    ) -> None:
        """Queue a message for a subscription of this node, until the node is polled."""
        if type_name != subscription.type_name:
            self.complain(
                f"type {topic}", f"{topic}: received {type_name} instead of {subscription.type_name}"
            )
            return

        def deliver() -> None:
            # the subscription may have ended after the message was queued
            if subscription in self.graph.subscriptions[topic]:
                subscription.callback(self.graph.codec.decode(type_name, encoded_message))

        self.deliveries.append(deliver)

    def create_client(self, service: str, service_type: str) -> Client:
        return _LocalClient(self, check_ros_name(service), self._parse_type(service_type, "srv"))

    def _serve_later(self, service: str, service_type: str, handler: RequestHandler) -> Callable[[], None]:
        server = _Server(
            self, self._parse_type(service_type, "srv"), handler, next(self.graph.server_numbers)
        )
        self.graph.servers[check_ros_name(service)] = server

        def end_service() -> None:
            if self.graph.servers.get(service) is server:
                del self.graph.servers[service]

        return end_service

    def poll(self, timeout_s: float = 0.0) -> bool:  # noqa: ARG002 - a wait would receive nothing
        # the number is taken first, since messages that callbacks queue belong to the next poll
        message_count = len(self.deliveries)
        for _ in range(message_count):
            self.deliveries.popleft()()
        return message_count > 0

    def close(self) -> None:
        self.deliveries.clear()
        self.graph.leave(self)


class _LocalClient(Client):
    def __init__(self, node: LocalNode, service: str, type_name: TypeName) -> None:
        super().__init__()
        self._node, self._service, self._type_name = node, service, type_name

    def call(
        self,
        request: Mapping[str, Any],
        on_response: MessageCallback,
        on_failure: FailureCallback | None = None,
    ) -> int:
        """Send a request. Without a server the request is lost, as over a network."""
        number = self._register_request(on_response, on_failure)
        received_request = self._copy_message("Request", request)
        server = self._server
        if server is not None:
            server.node.deliveries.append(partial(self._handle_request, server, received_request, number))
        return number

    def _copy_message(self, suffix: str, message: Mapping[str, Any]) -> Message:
        """Return the message that the other node receives.

        :param suffix: ``Request`` or ``Response``.
        """
        codec, type_name = self._node.graph.codec, self._type_name.derive(suffix)
        return codec.decode(type_name, codec.encode(type_name, message))

    def _handle_request(self, server: _Server, request: Message, number: int) -> None:
        def reply(response: Mapping[str, Any]) -> None:
            self._node.deliveries.append(
                partial(self._handle_response, number, self._copy_message("Response", response))
            )

        server.handler(request, reply)

    def _handle_response(self, number: int, response: Message) -> None:
        if number in self._pending_callbacks:
            on_response, _on_failure = self._pending_callbacks.pop(number)
            on_response(response)

    @property
    def _server(self) -> _Server | None:
        server = self._node.graph.servers.get(self._service)
        return None if server is None or server.type_name != self._type_name else server

    @property
    def server_numbers(self) -> frozenset[int]:
        return frozenset() if self._server is None else frozenset({self._server.number})

    def close(self) -> None:
        self._pending_callbacks.clear()
