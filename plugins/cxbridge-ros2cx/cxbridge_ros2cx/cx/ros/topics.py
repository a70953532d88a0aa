"""ROS topics in rules: publishers, subscriptions, and a fact for each received message."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2cx.cx.ros.plugin import (
    ADDRESS,
    STRING,
    Endpoint,
    EndpointGroup,
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


class Topics(EndpointGroup):
    """The topics of a plug-in."""

    def __init__(self, plugin: RosPlugin, prefix: str, type_name: TypeName | None = None) -> None:
        super().__init__(plugin, prefix, type_name)
        # the nouns and texts are those of the ROS 2 CX, whose generated plug-ins keep the facts of publishers
        self._subscriptions: EndpointTable[Endpoint] = EndpointTable(
            self, "subscription", "No subscription of {name} found to destroy, ignoring"
        )
        self._publishers: EndpointTable[_PublisherEndpoint] = EndpointTable(
            self,
            "publishers",
            "Publisher {name} not found in environment {env}",
            keeps_facts=type_name is not None,
        )

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, types = self.plugin, self.prefix, "sy;sy" if self.type_name is None else "sy"
        slots = {"topic": STRING, "type": STRING} if self.type_name is None else {"topic": STRING}
        plugin.define_template(env, f"{prefix}publisher", **slots)
        plugin.define_template(env, f"{prefix}subscription", **slots)
        plugin.define_template(env, f"{prefix}message", topic=STRING, msg_ptr=ADDRESS)
        plugin.define_functions(
            env,
            prefix,
            (
                ("create-publisher", partial(self._create_publisher, env), types),
                ("destroy-publisher", partial(self._publishers.close_endpoint, env), "sy"),
                ("publish", partial(self._publish, env), "e;sy"),
                ("create-subscription", partial(self._subscribe, env), types),
                ("destroy-subscription", partial(self._subscriptions.close_endpoint, env), "sy"),
            ),
        )

    def _create_publisher(self, env: ClipsEnvironment, topic: str, type_text: str | None = None) -> None:
        type_name, previous_endpoint = self.resolve_type(type_text), self._publishers.get(env, topic)
        if previous_endpoint is not None and self.type_name is None:
            self.plugin.log.warn(f"Already publishing to topic {topic}")
            return
        publisher = self.plugin.ros.node.create_publisher(self.plugin.ros.full_name(topic), str(type_name))
        if previous_endpoint is not None:  # as in the ROS 2 CX, a generated plug-in replaces its publisher
            previous_endpoint.close()
        self._publishers.add(
            env,
            topic,
            _PublisherEndpoint(type_name, publisher.close, publisher),
            f"{self.prefix}publisher",
            {"topic": str(topic)} | self.make_type_slot(type_text),
        )

    def _publish(self, env: ClipsEnvironment, message: ExternalAddress, topic: str) -> None:
        endpoint = self._publishers.get(env, topic)
        if endpoint is None:
            raise ClipsError(f"there is no publisher of {topic}: create a publisher first")
        view = self.plugin.messages.find(message)
        if view.type_name != endpoint.type_name:
            raise ClipsError(
                f"the topic {topic} has messages of type {endpoint.type_name}, not {view.type_name}"
            )
        endpoint.publisher.publish(view.fields)

    def _subscribe(self, env: ClipsEnvironment, topic: str, type_text: str | None = None) -> None:
        """Subscribe to a topic: each message from now on becomes a fact."""
        type_name, previous_endpoint = self.resolve_type(type_text), self._subscriptions.get(env, topic)
        if previous_endpoint is not None and self.type_name is None:
            self.plugin.log.warn(f"Already subscribed to topic {topic}")
            return
        if previous_endpoint is not None:  # as in the ROS 2 CX, a generated plug-in replaces its subscription
            previous_endpoint.close()
        close = self.plugin.ros.node.subscribe(
            self.plugin.ros.full_name(topic),
            str(type_name),
            partial(self._assert_message, env, str(topic), type_name),
            right=Right.CONTROL,
        )
        self._subscriptions.add(
            env,
            topic,
            Endpoint(type_name, close),
            f"{self.prefix}subscription",
            {"topic": str(topic)} | self.make_type_slot(type_text),
        )

    def _assert_message(
        self, env: ClipsEnvironment, topic: str, type_name: TypeName, message: Message
    ) -> None:
        self.plugin.assert_fact(
            env,
            f"{self.prefix}message",
            {"topic": topic, "msg-ptr": self.plugin.messages.add_received(type_name, message)},
        )
