"""Interfaces of the blackboard as topics of ROS 2, as a component."""

from __future__ import annotations

from fnmatch import fnmatchcase

from cxbridge.closing import Closing
from cxbridge.mainloop import Hook
from cxbridge.run.agent import Run
from cxbridge.run.components.component import Component
from cxbridge_ros2.executor import NodeSettings
from cxbridge_ros2.interfaces.definitions import definitions_of
from cxbridge_ros2.interfaces.settings import TREE, WRITE, TopicSettings, topic_settings
from cxbridge_ros2.interfaces.topics import PublishedInterfaces, WrittenInterface, check_mapping
from cxbridge_ros2.node import Node
from cxbridge_ros2.trees import placed


class Ros2Interfaces(Component):
    """Publishes interfaces, and writes those that come from ROS.

    :raises CxbridgeError: when the configuration is invalid, or a domain cannot be joined.
    """

    hooks = (Hook.SENSOR_ACQUIRE, Hook.POST_LOOP)
    description = "Interfaces as topics of ROS 2"

    def __init__(self, context: Run) -> None:
        self._context = context
        self._nodes: list[Node] = []
        self._written: list[WrittenInterface] = []
        self._published: list[PublishedInterfaces] = []
        found: dict[NodeSettings, list[TopicSettings]] = {}
        for each in topic_settings(context.config, context.paths.confdir):
            found.setdefault(each.node, []).append(each)
        try:
            for number, (place, topics) in enumerate(found.items(), start=1):
                self._join(f"cxbridge_{context.name}_blackboard{number if number > 1 else ''}", place, topics)
        except Exception:
            self.close()
            raise

    def _join(self, name: str, place: NodeSettings, topics: list[TopicSettings]) -> None:
        """Make a node for all topics that are in the same place."""
        registry = self._context.registry
        types = {each.key: self._types(each) for each in topics}
        texts: dict[str, str] = {}
        for each in topics:
            for schema in map(registry.schema, types[each.key] if each.type is None else ()):
                texts.update(definitions_of(schema))
        definitions = place.definitions(texts)
        for each in topics:
            with placed(self._context.config, f"{TREE}/{each.key}"):
                for schema in map(registry.schema, types[each.key]):
                    check_mapping(each, schema, definitions)
        report = self._context.bus.logger("Ros2Interfaces").warn
        node = place.join(name, definitions, report, self._context.rights)
        self._nodes.append(node)
        for each in sorted(topics, key=lambda each: each.direction != WRITE):
            with placed(self._context.config, f"{TREE}/{each.key}"):
                self._begin(each, node)

    def _types(self, settings: TopicSettings) -> list[str]:
        """Return the types of interfaces that are meant.

        :raises CxbridgeError: when there is none.
        """
        registry, glob = self._context.registry, settings.pattern.type_glob
        found = [name for name in registry.names() if fnmatchcase(name, glob)]
        if not found:
            with placed(self._context.config, f"{TREE}/{settings.key}"):
                registry.schema(glob)  # says which there are
        return found

    def _begin(self, settings: TopicSettings, node: Node) -> None:
        board, log = self._context.board, self._context.bus.logger("Ros2Interfaces")
        if settings.direction == WRITE:
            self._written.append(WrittenInterface(settings, node, board, log))
        else:
            ours = {each.uid for each in self._written}
            self._published.append(PublishedInterfaces(settings, node, board, log, ours))

    def loop(self) -> None:
        """Take incoming messages, and publish new writes."""
        for node in self._nodes:
            node.poll()
        for written in self._written:
            written.loop()
        for published in self._published:
            published.loop()

    def close(self) -> None:
        """Leave the domains."""
        parts: tuple[Closing, ...] = (*self._published, *self._written, *self._nodes)
        for part in parts:
            part.close()
        self._published, self._written, self._nodes = [], [], []
