"""Serves a run live to Foxglove, over its WebSocket protocol (foxglove-sdk)."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, TypeAlias

from foxglove import Context, start_server
from foxglove.channel import Channel
from foxglove.websocket import ChannelView, Client, ServerListener

from cxbridge.errors import CxbridgeError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, EventBus, LoopTime
from cxbridge.trace.codec import dump, encode, schema_of
from cxbridge_web.foxglove.door import FoxgloveDoor, hidden_host
from cxbridge_web.foxglove.messages import FoxgloveMessage, foxglove_messages
from cxbridge_web.foxglove.schemas import json_schema
from cxbridge_web.foxglove.settings import FoxgloveSettings

MOST_LASTING: Final = 1000
"""Messages of a topic that are kept for clients that subscribe later; of more, those that came last."""

_COMPONENT: Final = "Foxglove"
_Encoded: TypeAlias = Callable[[], bytes]


class FoxgloveServer:
    """Sends the events of a bus, and what panels show of them, to all clients that subscribe.

    It receives events from when it is made; any thread may emit them.

    :param name: what clients see as the server's name.
    """

    def __init__(self, bus: EventBus, settings: FoxgloveSettings, name: str = "cxbridge") -> None:
        self._bus = bus
        self._settings = settings
        self._name = name
        self._context = Context()
        self._channels: dict[str, Channel] = {}
        self._lasting: dict[str, dict[str, tuple[int, _Encoded]]] = {}
        self._asked: set[str] = set()
        self._lock = threading.Lock()
        self._server: Any = None
        self._door: FoxgloveDoor | None = None
        self.url = ""
        """The server's address, once it serves."""
        kinds: tuple[type[Event], ...] = (*RecordLevel.TRANSITIONS.event_types, LoopTime)
        # Before the first client: the SDK advertises a channel a moment before it accepts subscriptions.
        for kind in kinds:
            if not kind.KIND.topic_field:
                self._add_event(kind.KIND.topic, kind)
        bus.subscribe(self._take, *kinds)

    def start(self) -> None:
        """Begin to serve.

        :raises CxbridgeError: when the port cannot be had.
        """
        host, port, log = self._settings.host, self._settings.port, self._bus.logger(_COMPONENT)
        behind = hidden_host()
        try:
            self._server = start_server(
                name=self._name,
                host=behind,
                port=0,
                context=self._context,
                server_listener=_Subscriptions(self._note),
            )
            self._door = FoxgloveDoor(self._settings, (behind, self._server.port))
        except (OSError, RuntimeError) as error:
            self.stop()
            raise CxbridgeError(
                f"the Foxglove server cannot be at {host}:{port}: {error}",
                hint="choose another port; 0: any free one",
            ) from error
        shown = f"[{host}]" if ":" in host else host
        self.url = f"ws://{shown}:{self._door.port}"
        log.info(f"Foxglove connects to {self.url}")

    def stop(self) -> None:
        """Serve no more. A second call does nothing."""
        self._bus.unsubscribe(self._take)
        door, self._door = self._door, None
        server, self._server = self._server, None
        if server is not None:
            server.stop()
        if door is not None:
            door.close()

    def attend(self) -> None:
        """Send lasting messages to new subscribers. Called once a loop."""
        if not self._asked:
            return
        with self._lock:
            asked, self._asked = self._asked, set()
            found = [(topic, list(self._lasting.get(topic, {}).values())) for topic in asked]
        for topic, kept in found:
            for time_us, encoded in kept:
                self._channels[topic].log(encoded(), log_time=time_us * 1000)

    def _note(self, topic: str) -> None:
        """Note a subscription, in a thread of the server: it is not in force yet."""
        with self._lock:
            self._asked.add(topic)

    def _take(self, event: Event) -> None:
        self._send_event(event)
        for message in foxglove_messages(event):
            self._send(message, event.time_us)

    def _send_event(self, event: Event) -> None:
        kind = type(event).KIND
        about = getattr(event, kind.topic_field) if kind.topic_field else ""
        topic = kind.topic + about.replace("::", "/", 1)
        if topic not in self._channels:
            self._add_event(topic, type(event))
        subject = "\0".join(str(getattr(event, name)) for name in kind.subject)
        self._log(topic, subject, event.time_us, partial(encode, event))

    def _send(self, message: FoxgloveMessage, time_us: int) -> None:
        if message.topic not in self._channels:
            self._add(message.topic, json_schema(message.schema))
        self._log(message.topic, message.lasting, time_us, partial(_encoded, message))

    def _log(self, topic: str, subject: str, time_us: int, encoded: _Encoded) -> None:
        """Send a message to subscribers, and keep it if it reports a state.

        :param subject: the subject of the reported state; empty: the message reports no state.
        """
        channel, time_us = self._channels[topic], max(time_us, 0)
        if subject:
            with self._lock:
                kept = self._lasting.setdefault(topic, {})
                kept.pop(subject, None)  # the last one is at the end
                kept[subject] = time_us, encoded
                if len(kept) > MOST_LASTING:
                    del kept[next(iter(kept))]
        if channel.has_sinks():
            channel.log(encoded(), log_time=time_us * 1000)

    def _add_event(self, topic: str, kind: type[Event]) -> None:
        self._add(topic, {**schema_of(kind), "title": f"cxbridge.{kind.__name__}"})

    def _add(self, topic: str, schema: Mapping[str, Any]) -> None:
        """Make the channel of a topic, unless another thread has just done so."""
        with self._lock:
            if topic not in self._channels:
                self._channels[topic] = Channel(topic, schema=dict(schema), context=self._context)


def _encoded(message: FoxgloveMessage) -> bytes:
    return dump(message.data).encode("utf-8", "backslashreplace")


class _Subscriptions(ServerListener):
    """Reports the topics that clients subscribe to.

    :param note: called in a thread of the server.
    """

    def __init__(self, note: Any) -> None:
        self._note = note

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002 - the SDK's signature
        """Report one."""
        self._note(channel.topic)
