"""Topics in rules: publishers, subscriptions, and a fact for each received message."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

from msgspec import Struct

from cxbridge.errors import ClipsError
from cxbridge.executive.host.values import ExternalAddress
from cxbridge.rights import Right
from cxbridge_ros2.names import parse_type
from cxbridge_ros2cx.cx.ros.plugin import ADDRESS, STRING, RosPlugin

if TYPE_CHECKING:
    from collections.abc import Callable

    from cxbridge.executive.host.environment import ClipsEnvironment
    from cxbridge.executive.host.values import Value
    from cxbridge_ros2.messages import Message
    from cxbridge_ros2.names import TypeName
    from cxbridge_ros2.node import Publisher

_Key = tuple[str, str]  # environment, topic


class _OpenTopic(Struct, eq=False):
    """A publisher or subscription of an environment, and its fact."""

    kind: TypeName
    end: Callable[[], None]
    fact: int | None
    publisher: Publisher | None = None


class Topics:
    """The topics of a plug-in.

    :param prefix: the prefix of functions and templates: ``ros-msgs-``.
    :param kind: the type of all messages; None if functions take the type as an argument.
    """

    def __init__(self, plugin: RosPlugin, prefix: str, kind: TypeName | None = None) -> None:
        self._plugin, self._prefix, self._kind = plugin, prefix, kind
        self._publishers: dict[_Key, _OpenTopic] = {}
        self._subscriptions: dict[_Key, _OpenTopic] = {}

    def define(self, env: ClipsEnvironment) -> None:
        plugin, prefix, types = self._plugin, self._prefix, "sy;sy" if self._kind is None else "sy"
        slots = {"topic": STRING, "type": STRING} if self._kind is None else {"topic": STRING}
        plugin.template(env, f"{prefix}publisher", **slots)
        plugin.template(env, f"{prefix}subscription", **slots)
        plugin.template(env, f"{prefix}message", topic=STRING, msg_ptr=ADDRESS)
        plugin.define(env, f"{prefix}create-publisher", partial(self._publish_on, env), types)
        plugin.define(env, f"{prefix}destroy-publisher", partial(self._end_publisher, env), "sy")
        plugin.define(env, f"{prefix}publish", partial(self._publish, env), "e;sy")
        plugin.define(env, f"{prefix}create-subscription", partial(self._subscribe, env), types)
        plugin.define(env, f"{prefix}destroy-subscription", partial(self._end_subscription, env), "sy")

    def _type(self, text: str | None) -> TypeName:
        return self._kind if self._kind is not None else parse_type(str(text))

    def _slots(self, topic: str, text: str | None) -> dict[str, Value]:
        return {"topic": str(topic)} | ({"type": str(text)} if self._kind is None else {})

    def _publish_on(self, env: ClipsEnvironment, topic: str, text: str | None = None) -> None:
        key, kind = (env.name, str(topic)), self._type(text)
        previous = self._publishers.get(key)
        if previous is not None and self._kind is None:
            self._plugin.log.warn(f"Already publishing to topic {topic}")
            return
        publisher = self._plugin.ros.node.publisher(self._plugin.ros.whole(topic), str(kind))
        if previous is not None:
            previous.end()
        fact = self._plugin.add_fact(env, f"{self._prefix}publisher", self._slots(topic, text))
        self._publishers[key] = _OpenTopic(kind, publisher.close, fact, publisher)

    def _end_publisher(self, env: ClipsEnvironment, topic: str) -> None:
        """Close a publisher; the fact of a generated plug-in stays, as in the original."""
        entry = self._publishers.pop((env.name, str(topic)), None)
        if entry is None:
            self._plugin.log.warn(f"Publisher {topic} not found in environment {env.name}")
            return
        entry.end()
        if self._kind is None and entry.fact is not None:
            env.retract(entry.fact)

    def _publish(self, env: ClipsEnvironment, message: ExternalAddress, topic: str) -> None:
        entry = self._publishers.get((env.name, str(topic)))
        if entry is None or entry.publisher is None:
            raise ClipsError(f"there is no publisher of {topic}: create it first")
        view = self._plugin.messages.find(message)
        if view.kind != entry.kind:
            raise ClipsError(f"the topic {topic} has messages of type {entry.kind}, not {view.kind}")
        entry.publisher.publish(view.fields)

    def _subscribe(self, env: ClipsEnvironment, topic: str, text: str | None = None) -> None:
        """Assert a fact for each further message of a topic."""
        key, kind = (env.name, str(topic)), self._type(text)
        previous = self._subscriptions.get(key)
        if previous is not None:
            if self._kind is None:
                self._plugin.log.warn(f"Already subscribed to topic {topic}")
                return
            previous.end()
        end = self._plugin.ros.node.subscribe(
            self._plugin.ros.whole(topic),
            str(kind),
            partial(self._receive, env, str(topic), kind),
            needs=Right.CONTROL,
        )
        fact = self._plugin.add_fact(env, f"{self._prefix}subscription", self._slots(topic, text))
        self._subscriptions[key] = _OpenTopic(kind, end, fact)

    def _receive(self, env: ClipsEnvironment, topic: str, kind: TypeName, message: Message) -> None:
        address = self._plugin.messages.take(kind, message)
        self._plugin.add_fact(env, f"{self._prefix}message", {"topic": topic, "msg-ptr": address})

    def _end_subscription(self, env: ClipsEnvironment, topic: str) -> None:
        entry = self._subscriptions.pop((env.name, str(topic)), None)
        if entry is None:
            self._plugin.log.warn(f"No subscription of {topic} found to destroy, ignoring")
            return
        entry.end()
        if entry.fact is not None:
            env.retract(entry.fact)

    def close(self, env: ClipsEnvironment) -> None:
        """Close an environment's open publishers and subscriptions, with a warning."""
        for kind, table in (("subscription", self._subscriptions), ("publishers", self._publishers)):
            for key in [key for key in table if key[0] == env.name]:
                table.pop(key).end()
                self._plugin.log.warn(f"Environment {env.name} has open {key[1]} {kind}, cleaning up ...")
