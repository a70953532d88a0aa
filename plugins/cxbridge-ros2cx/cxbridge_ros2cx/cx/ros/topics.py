"""Topics in rules: publishers, subscriptions, and a fact for each received message."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2cx.cx.ros.plugin import (
    ADDRESS,
    STRING,
    Definition,
    Endpoint,
    Endpoints,
    EndpointTable,
    RosPlugin,
)

if TYPE_CHECKING:
    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2.node import Publisher


class _PublisherEndpoint(Endpoint):
    publisher: Publisher


class Topics(Endpoints):
    """The topics of a plug-in."""

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        super().__init__(plugin, prefix, kind)
        self._subscriptions: EndpointTable[Endpoint] = EndpointTable(
            plugin, "subscription", "No subscription of {name} found to destroy, ignoring"
        )
        self._publishers: EndpointTable[_PublisherEndpoint] = EndpointTable(
            plugin,
            "publishers",
            "Publisher {name} not found in environment {env}",
            keeps_facts=kind is not None,
        )

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, types = self.plugin, self.prefix, "sy;sy" if self.kind is None else "sy"
        slots = {"topic": STRING, "type": STRING} if self.kind is None else {"topic": STRING}
        plugin.template(env, f"{prefix}publisher", **slots)
        plugin.template(env, f"{prefix}subscription", **slots)
        plugin.template(env, f"{prefix}message", topic=STRING, msg_ptr=ADDRESS)
        functions: tuple[Definition, ...] = (
            ("create-publisher", partial(self._create_publisher, env), types),
            ("destroy-publisher", partial(self._publishers.end, env), "sy"),
            ("publish", partial(self._publish, env), "e;sy"),
            ("create-subscription", partial(self._subscribe, env), types),
            ("destroy-subscription", partial(self._subscriptions.end, env), "sy"),
        )
        plugin.define_all(env, prefix, functions)

    def _create_publisher(self, env: ClipsEnvironment, topic: str, text: str | None = None) -> None:
        kind, previous = self.type_of(text), self._publishers.get(env, topic)
        if previous is not None and self.kind is None:
            self.plugin.log.warn(f"Already publishing to topic {topic}")
            return
        publisher = self.plugin.ros.node.create_publisher(self.plugin.ros.full_name(topic), str(kind))
        if previous is not None:  # a generated plug-in of the original replaces its publisher
            previous.close()
        slots = {"topic": str(topic)} | self.type_slot(text)
        fact = self.plugin.add_fact(env, f"{self.prefix}publisher", slots)
        self._publishers[env, topic] = _PublisherEndpoint(kind, publisher.close, fact, publisher)

    def _publish(self, env: ClipsEnvironment, message: ExternalAddress, topic: str) -> None:
        endpoint = self._publishers.get(env, topic)
        if endpoint is None:
            raise ClipsError(f"there is no publisher of {topic}: create it first")
        view = self.plugin.messages.find(message)
        if view.kind != endpoint.kind:
            raise ClipsError(f"the topic {topic} has messages of type {endpoint.kind}, not {view.kind}")
        endpoint.publisher.publish(view.fields)

    def _subscribe(self, env: ClipsEnvironment, topic: str, text: str | None = None) -> None:
        """Assert a fact for each further message of a topic."""
        kind, previous = self.type_of(text), self._subscriptions.get(env, topic)
        if previous is not None and self.kind is None:
            self.plugin.log.warn(f"Already subscribed to topic {topic}")
            return
        if previous is not None:  # likewise, it replaces its subscription
            previous.close()
        receive = partial(self._receive, env, str(topic), kind)
        end = self.plugin.ros.node.subscribe(
            self.plugin.ros.full_name(topic), str(kind), receive, right=Right.CONTROL
        )
        slots = {"topic": str(topic)} | self.type_slot(text)
        fact = self.plugin.add_fact(env, f"{self.prefix}subscription", slots)
        self._subscriptions[env, topic] = Endpoint(kind, end, fact)

    def _receive(self, env: ClipsEnvironment, topic: str, kind: TypeName, message: Message) -> None:
        address = self.plugin.messages.take(kind, message)
        self.plugin.add_fact(env, f"{self.prefix}message", {"topic": topic, "msg-ptr": address})

    def close(self, env: ClipsEnvironment) -> None:
        self._subscriptions.close(env)
        self._publishers.close(env)
