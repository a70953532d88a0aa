"""A node's connection to a hub."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from cxbridge.closing import Closing
from cxbridge.rights import Right, right_of_frame
from cxbridge_ros2.hub.words import HubProtocol, Sign, Word
from cxbridge_ros2.node import Node, Publisher
from cxbridge_ros2.qos import QosProfile

_QOS: Final = QosProfile(depth=100)  # qoS of PlanSys2 and of the thesis


class Hub(Closing):
    """Publishes messages on the topic of a protocol, and receives all messages, its own included.

    :param node: a node that its owner polls.
    :param namespace: the prefix of topic names.
    :param on_word: called with each message.
    :param signed: called with each heartbeat, or None.
    """

    def __init__(
        self,
        node: Node,
        protocol: HubProtocol,
        namespace: str,
        on_word: Callable[[Word], None],
        signed: Callable[[Sign], None] | None = None,
    ) -> None:
        self._protocol = protocol
        self._node = node
        self.topic = f"{namespace}{protocol.topic}"
        self._signs_topic = f"{namespace}{protocol.signs_topic}"
        self._signs: Publisher | None = None
        self._words = node.publisher(self.topic, protocol.message_type, _QOS)
        self._ends = [
            node.subscribe(
                self.topic,
                protocol.message_type,
                lambda message: on_word(protocol.word(message)),
                _QOS,
                needs=right_of_frame("ros2-performers", "word"),
            )
        ]
        if signed is not None:
            self._ends.append(
                node.subscribe(
                    self._signs_topic,
                    protocol.signs_type,
                    lambda message: signed(protocol.sign(message)),
                    _QOS,
                    needs=Right.LOOK,
                )
            )

    def say(self, word: Word) -> None:
        """Publish a message."""
        self._words.publish(self._protocol.message(word))

    def give_sign(self, sign: Sign, now_us: int) -> None:
        """Publish a heartbeat.

        :param now_us: microseconds since the epoch.
        """
        if self._signs is None:
            self._signs = self._node.publisher(self._signs_topic, self._protocol.signs_type, _QOS)
        self._signs.publish(self._protocol.sign_message(sign, now_us))

    def close(self) -> None:
        for end in self._ends:
            end()
        self._ends = []
        self._words.close()
        if self._signs is not None:
            self._signs.close()
