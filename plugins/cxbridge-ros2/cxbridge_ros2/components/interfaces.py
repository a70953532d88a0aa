"""The component that maps interfaces of the blackboard to topics of ROS 2."""

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
    """Publishes interfaces, and writes received messages to interfaces."""

    hooks = (Hook.SENSOR_ACQUIRE, Hook.POST_LOOP)
    description = "Interfaces as topics of ROS 2"

    def __init__(self, context: Run) -> None:
        self._context = context
        self._nodes: list[Node] = []
        self._written: list[WrittenInterface] = []
        self._published: list[PublishedInterfaces] = []
        topics_of_nodes: dict[NodeSettings, list[TopicSettings]] = {}
        for each in topic_settings(context.config, context.paths.confdir):
            topics_of_nodes.setdefault(each.node, []).append(each)
        try:
            for number, (node_settings, topics) in enumerate(topics_of_nodes.items(), start=1):
                self._join(
                    f"cxbridge_{context.name}_blackboard{number if number > 1 else ''}", node_settings, topics
                )
        except Exception:
            self.close()
            raise

    def _join(self, name: str, node_settings: NodeSettings, topics: list[TopicSettings]) -> None:
        registry = self._context.registry
        types = {each.key: self._types(each) for each in topics}
        texts: dict[str, str] = {}
        for each in topics:
            for schema in map(registry.schema, types[each.key] if each.type is None else ()):
                texts.update(definitions_of(schema))
        definitions = node_settings.definitions(texts)
        for each in topics:
            with placed(self._context.config, f"{TREE}/{each.key}"):
                for schema in map(registry.schema, types[each.key]):
                    check_mapping(each, schema, definitions)
        report = self._context.bus.logger("Ros2Interfaces").warn
        node = node_settings.join(name, definitions, report, self._context.rights)
        self._nodes.append(node)
        # Written interfaces first: they are left out of the published ones.
        for each in sorted(topics, key=lambda each: each.direction != WRITE):
            with placed(self._context.config, f"{TREE}/{each.key}"):
                self._begin(each, node)

    def _types(self, settings: TopicSettings) -> list[str]:
        registry, glob = self._context.registry, settings.pattern.type_glob
        matching_types = [name for name in registry.names() if fnmatchcase(name, glob)]
        if not matching_types:
            with placed(self._context.config, f"{TREE}/{settings.key}"):
                registry.schema(glob)  # raises the error with the known types
        return matching_types

    def _begin(self, settings: TopicSettings, node: Node) -> None:
        board, log = self._context.board, self._context.bus.logger("Ros2Interfaces")
        if settings.direction == WRITE:
            self._written.append(WrittenInterface(settings, node, board, log))
        else:
            written_uids = {each.uid for each in self._written}
            self._published.append(PublishedInterfaces(settings, node, board, log, written_uids))

    def loop(self) -> None:
        for node in self._nodes:
            node.poll()
        for written in self._written:
            written.loop()
        for published in self._published:
            published.loop()

    def close(self) -> None:
        parts: tuple[Closing, ...] = (*self._published, *self._written, *self._nodes)
        for part in parts:
            part.close()
        self._published, self._written, self._nodes = [], [], []
