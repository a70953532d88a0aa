"""A client of Foxglove's WebSocket protocol, written after its specification (foxglove.sdk.v1)."""

from __future__ import annotations

import json
import re
import struct
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any, Final

import pytest

PROTOCOL: Final = "foxglove.sdk.v1"
_MESSAGE_DATA: Final = 1
_HEAD: Final = struct.Struct("<BIQ")
"""Opcode, number of the subscription, log time in nanoseconds."""

_WAIT_S: Final = 30.0
_MOST_FRAMES: Final = 20_000
_REFUSED: Final = re.compile(r"Unknown channel ID: (\d+)")
"""What foxglove-sdk answers to a client that subscribes in the moment between advertising and accepting."""


@dataclass
class FoxgloveClient:
    """Subscribes to everything that is advertised.

    :ivar channels: the advertised channels, by topic.
    :ivar messages: the messages, by topic: times in nanoseconds, and the JSON.
    """

    socket: Any
    info: dict[str, Any] = field(default_factory=dict)
    channels: dict[str, dict[str, Any]] = field(default_factory=dict)
    messages: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)
    _topics: dict[int, str] = field(default_factory=dict)

    def receive(self) -> None:
        """Take one frame."""
        frame = self.socket.recv(timeout=_WAIT_S)
        if isinstance(frame, bytes):
            opcode, subscription, time_ns = _HEAD.unpack_from(frame)
            if opcode == _MESSAGE_DATA:
                topic = self._topics[subscription]
                data = json.loads(frame[_HEAD.size :])
                self.messages.setdefault(topic, []).append((time_ns, data))
            return
        said = json.loads(frame)
        if said["op"] == "serverInfo":
            self.info = said
        elif said["op"] == "advertise":
            self._subscribe(said["channels"])
        elif said["op"] == "status" and (refused := _REFUSED.search(said["message"])):
            self._subscribe([c for c in self.channels.values() if c["id"] == int(refused[1])])

    def _subscribe(self, channels: list[dict[str, Any]]) -> None:
        subscriptions = []
        for channel in channels:
            number = 100 + len(self._topics)  # ours, not the channel's
            self._topics[number] = channel["topic"]
            self.channels[channel["topic"]] = channel
            subscriptions.append({"id": number, "channelId": channel["id"]})
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def until(self, enough: Callable[[], bool]) -> None:
        """Receive until there is enough."""
        for _ in range(_MOST_FRAMES):
            if enough():
                return
            self.receive()
        raise AssertionError(f"there is not enough: {sorted(self.messages)}")

    def has(self, *topics: str) -> bool:
        """Whether something came on each of these topics."""
        return all(topic in self.messages for topic in topics)


@contextmanager
def connected(url: str) -> Iterator[FoxgloveClient]:
    """Connect to a server, and receive its description."""
    client = pytest.importorskip("websockets.sync.client", reason="needs websockets")
    # a queue that was full would keep the answer to our good-bye away from us, for ten seconds
    with client.connect(url, subprotocols=[PROTOCOL], max_size=None, max_queue=None) as socket:
        assert socket.subprotocol == PROTOCOL
        found = FoxgloveClient(socket)
        found.until(lambda: bool(found.info))
        yield found
