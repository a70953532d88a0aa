"""A client of Foxglove's WebSocket protocol foxglove.sdk.v1."""

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
_MAX_FRAMES: Final = 20_000
_REFUSED: Final = re.compile(r"Unknown channel ID: (\d+)")
"""The answer of foxglove-sdk to a subscription between the advertisement and the acceptance of a channel."""


@dataclass
class FoxgloveClient:
    """Subscribes to all advertised channels.

    :ivar server_info: the description of the server, empty before its arrival.
    :ivar channels: the advertised channels by topic.
    :ivar messages: the messages by topic, with times in nanoseconds and the JSON.
    """

    socket: Any
    server_info: dict[str, Any] = field(default_factory=dict)
    channels: dict[str, dict[str, Any]] = field(default_factory=dict)
    messages: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)
    _topics: dict[int, str] = field(default_factory=dict)

    def receive(self) -> None:
        """Handle the next frame."""
        frame = self.socket.recv(timeout=_WAIT_S)
        if isinstance(frame, bytes):
            opcode, subscription, time_ns = _HEAD.unpack_from(frame)
            if opcode == _MESSAGE_DATA:
                topic = self._topics[subscription]
                data = json.loads(frame[_HEAD.size :])
                self.messages.setdefault(topic, []).append((time_ns, data))
            return
        operation = json.loads(frame)
        if operation["op"] == "serverInfo":
            self.server_info = operation
        elif operation["op"] == "advertise":
            self._subscribe(operation["channels"])
        elif operation["op"] == "status" and (refused := _REFUSED.search(operation["message"])):
            self._subscribe(
                [channel for channel in self.channels.values() if channel["id"] == int(refused[1])]
            )

    def _subscribe(self, channels: list[dict[str, Any]]) -> None:
        subscriptions = []
        for channel in channels:
            number = 100 + len(self._topics)  # the subscription's number, not the channel's
            self._topics[number] = channel["topic"]
            self.channels[channel["topic"]] = channel
            subscriptions.append({"id": number, "channelId": channel["id"]})
        self.socket.send(json.dumps({"op": "subscribe", "subscriptions": subscriptions}))

    def until(self, is_enough: Callable[[], bool]) -> None:
        """Handle frames until ``is_enough`` returns True."""
        for _ in range(_MAX_FRAMES):
            if is_enough():
                return
            self.receive()
        raise AssertionError(f"not enough messages: {sorted(self.messages)}")

    def has(self, *topics: str) -> bool:
        """Return whether each topic has a message."""
        return all(topic in self.messages for topic in topics)


@contextmanager
def connected(url: str) -> Iterator[FoxgloveClient]:
    """Connect to a server, and receive its description."""
    client = pytest.importorskip("websockets.sync.client", reason="needs websockets")
    # a full queue would delay the answer to the close frame for ten seconds
    with client.connect(url, subprotocols=[PROTOCOL], max_size=None, max_queue=None) as socket:
        assert socket.subprotocol == PROTOCOL
        connection = FoxgloveClient(socket)
        connection.until(lambda: bool(connection.server_info))
        yield connection
