"""The connection of a node to a hub, for callers and performers."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.rights import Right, right_of_frame
from cxbridge_ros2.hub.protocol import Heartbeat, HubMessage, HubProtocol
from cxbridge_ros2.node import Node
from cxbridge_ros2.qos import QosProfile

_HUB_QOS: Final = QosProfile(depth=100)  # the profile of PlanSys2 and of ros2-clips-executive


class Hub:
    """Publishes messages and heartbeats on the topics of a protocol, and receives those of all nodes.

    Each node also receives its own messages and heartbeats.

    :param node: a node that its owner polls, and closes to leave the hub.
    :param namespace: the prefix of the topics.
    :param on_message: called with each message.
    :param on_heartbeat: called with each heartbeat; None to receive no heartbeats.
    """

    def __init__(
        self,
        node: Node,
        protocol: HubProtocol,
        namespace: str,
        on_message: Callable[[HubMessage], None],
        on_heartbeat: Callable[[Heartbeat], None] | None = None,
    ) -> None:
        self._protocol = protocol
        topic, heartbeat_topic = f"{namespace}{protocol.topic}", f"{namespace}{protocol.heartbeat_topic}"
        self._message_publisher = node.create_publisher(topic, protocol.message_type, _HUB_QOS)
        self._heartbeat_publisher = node.create_publisher(heartbeat_topic, protocol.heartbeat_type, _HUB_QOS)
        node.subscribe(
            topic,
            protocol.message_type,
            lambda fields: on_message(protocol.decode(fields)),
            _HUB_QOS,
            right=right_of_frame("ros2-performers", "word"),
        )
        if on_heartbeat is not None:
            node.subscribe(
                heartbeat_topic,
                protocol.heartbeat_type,
                lambda fields: on_heartbeat(protocol.decode_heartbeat(fields)),
                _HUB_QOS,
                right=Right.LOOK,
            )

    def publish(self, message: HubMessage) -> None:
        self._message_publisher.publish(self._protocol.encode(message))

    def publish_heartbeat(self, heartbeat: Heartbeat, now_us: int) -> None:
        """Publish a heartbeat.

        :param now_us: microseconds since the epoch.
        """
        self._heartbeat_publisher.publish(self._protocol.encode_heartbeat(heartbeat, now_us))
