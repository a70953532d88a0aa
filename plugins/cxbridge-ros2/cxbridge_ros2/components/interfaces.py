"""The component that maps interfaces of the blackboard to topics of ROS 2, and topics to interfaces."""

from __future__ import annotations

from fnmatch import fnmatchcase

from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_ros2.interfaces.definitions import generate_definitions
from cxbridge_ros2.interfaces.settings import SECTION, WRITE, TopicSettings, read_topic_settings
from cxbridge_ros2.interfaces.topics import PublishedInterfaces, WrittenInterface, check_mapping
from cxbridge_ros2.node import Node
from cxbridge_ros2.settings import NodeSettings, locate_errors


class Ros2Interfaces(Component):
    """Publishes interfaces, and writes received messages to interfaces."""

    # received messages are written before the agent thinks; writes of the loop are published at its end
    hooks = (Hook.SENSOR_ACQUIRE, Hook.POST_LOOP)
    description = "Interfaces as topics of ROS 2"

    def __init__(self, context: Run) -> None:
        self._context = context
        self._log = context.bus.logger("Ros2Interfaces")
        self._nodes: list[Node] = []
        self._written_interfaces: list[WrittenInterface] = []
        self._published_interfaces: list[PublishedInterfaces] = []
        # topics with equal settings of their nodes share a node
        topics_by_node: dict[NodeSettings, list[TopicSettings]] = {}
        for topic in read_topic_settings(context.config, context.paths.confdir):
            topics_by_node.setdefault(topic.node, []).append(topic)
        try:
            for number, (settings, topics) in enumerate(topics_by_node.items(), start=1):
                self._join_domain(
                    f"cxbridge_{context.name}_blackboard{number if number > 1 else ''}", settings, topics
                )
        except Exception:
            self.close()
            raise

    def _join_domain(self, name: str, settings: NodeSettings, topics: list[TopicSettings]) -> None:
        context, registry = self._context, self._context.registry
        schemas_by_key = {
            topic.key: [*map(registry.schema, self._find_matching_types(topic))] for topic in topics
        }
        generated_topics = (topic for topic in topics if topic.type_name is None)
        definitions = settings.load_definitions(
            generate_definitions(schema for topic in generated_topics for schema in schemas_by_key[topic.key])
        )
        node = settings.join(name, definitions, self._log.warn, context.rights)
        self._nodes.append(node)
        # the written interfaces first, since PublishedInterfaces excludes the written interfaces
        for topic in sorted(topics, key=lambda topic: topic.direction != WRITE):
            with locate_errors(context.config, f"{SECTION}/{topic.key}"):
                for schema in schemas_by_key[topic.key]:
                    check_mapping(topic, schema, definitions)
                self._add_topic(topic, node)

    def _find_matching_types(self, topic: TopicSettings) -> list[str]:
        """Return the names of the interface types that a topic's pattern matches, at least one.

        :raises InterfaceError: if the pattern matches no type.
        """
        registry, glob = self._context.registry, topic.pattern.type_glob
        matching_types = [name for name in registry.names() if fnmatchcase(name, glob)]
        if not matching_types:
            with locate_errors(self._context.config, f"{SECTION}/{topic.key}"):
                registry.schema(glob)  # raises the error about an unknown type
        return matching_types

    def _add_topic(self, topic: TopicSettings, node: Node) -> None:
        board = self._context.board
        if topic.direction == WRITE:
            self._written_interfaces.append(WrittenInterface(topic, node, board))
        else:
            written_uids = {interface.uid for interface in self._written_interfaces}
            self._published_interfaces.append(
                PublishedInterfaces(topic, node, board, self._log, written_uids)
            )

    def loop(self) -> None:
        for node in self._nodes:
            node.poll()
        for interfaces in self._published_interfaces:
            interfaces.loop()

    def close(self) -> None:
        for interface in (*self._published_interfaces, *self._written_interfaces):
            interface.close()
        for node in self._nodes:
            node.close()
