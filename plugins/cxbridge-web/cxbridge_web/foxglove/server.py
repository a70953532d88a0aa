"""A live server for Foxglove, over the WebSocket protocol of foxglove-sdk."""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final, TypeAlias

from foxglove import Context, start_server
from foxglove.channel import Channel
from foxglove.websocket import ChannelView, Client, ServerListener, WebSocketServer

from cxbridge.errors import CxbridgeError
from cxbridge.event_kinds import RecordLevel
from cxbridge.events import Event, EventBus, LoopTime
from cxbridge.listening import url_host
from cxbridge.trace.codec import encode, event_json_schema
from cxbridge_web.foxglove.messages import FoxgloveMessage, make_foxglove_messages
from cxbridge_web.foxglove.proxy import FoxgloveProxy, choose_hidden_host
from cxbridge_web.foxglove.schemas import make_json_schema
from cxbridge_web.foxglove.settings import FoxgloveSettings

# The number of states per topic that are kept for later subscribers: those that were updated last. Without
# a limit, a long run with ever new goals would fill the memory.
MAX_STATES_PER_TOPIC: Final = 1000

_COMPONENT: Final = "Foxglove"
_Encoder: TypeAlias = Callable[[], bytes]  # encodes a message when it is sent, which may be never


class FoxgloveServer(ServerListener):
    """Sends events of a bus and their messages for panels to all subscribed clients.

    The events are transitions and the times of loops, but no rules and facts. The server receives events from
    its creation on. Any thread may emit events.
    """

    def __init__(self, bus: EventBus, settings: FoxgloveSettings) -> None:
        self._bus = bus
        self._settings = settings
        self._context = Context()
        self._channels: dict[str, Channel] = {}
        # time (in microseconds) and message of each state, by topic and subject
        self._states: dict[str, dict[str, tuple[int, _Encoder]]] = {}
        self._new_topics: set[str] = set()  # topics with new subscribers
        self._lock = threading.Lock()  # guards channels, states and subscriptions
        self._server: WebSocketServer | None = None
        self._proxy: FoxgloveProxy | None = None
        self.url = ""  # address of the running server
        event_types: tuple[type[Event], ...] = (*RecordLevel.TRANSITIONS.event_types, LoopTime)
        # add channels before the first client: the SDK advertises a channel before it accepts subscriptions
        for event_type in event_types:
            if not event_type.KIND.topic_field:
                self._add_event_channel(event_type.KIND.topic, event_type)
        bus.subscribe(self._send_messages, *event_types)

    def start(self) -> None:
        """Start the server and its proxy.

        :raises CxbridgeError: if the address is unavailable.
        """
        host, port, log = self._settings.host, self._settings.port, self._bus.logger(_COMPONENT)
        inner_host = choose_hidden_host()
        try:
            self._server = start_server(
                name="cxbridge",
                host=inner_host,
                port=0,
                context=self._context,
                server_listener=self,
            )
            self._proxy = FoxgloveProxy(self._settings, (inner_host, self._server.port))
        except (OSError, RuntimeError) as error:
            self.stop()
            raise CxbridgeError(
                f"the Foxglove server cannot listen on {host}:{port}: {error}",
                hint="choose another port; 0: any free port",
            ) from error
        self.url = f"ws://{url_host(host)}:{self._proxy.port}"
        log.info(f"Foxglove connects to {self.url}")

    def stop(self) -> None:
        """Stop serving; repeated calls are harmless."""
        self._bus.unsubscribe(self._send_messages)
        proxy, self._proxy = self._proxy, None
        server, self._server = self._server, None
        if server is not None:
            server.stop()
        if proxy is not None:
            proxy.close()

    def serve_new_subscribers(self) -> None:
        """Send the kept states to new subscribers. Called once a loop."""
        if not self._new_topics:
            return
        with self._lock:
            topics, self._new_topics = self._new_topics, set()
            states_by_topic = [(topic, list(self._states.get(topic, {}).values())) for topic in topics]
        for topic, states in states_by_topic:
            for time_us, encode_message in states:
                self._channels[topic].log(encode_message(), log_time=time_us * 1000)

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:  # noqa: ARG002 - the SDK's signature
        """Queue the topic of a subscription, which is not active yet, for :meth:`serve_new_subscribers`.

        Called in a thread of the server.
        """
        with self._lock:
            self._new_topics.add(channel.topic)

    def _send_messages(self, event: Event) -> None:
        self._send_event(event)
        for message in make_foxglove_messages(event):
            self._send_panel_message(message, event.time_us)

    def _send_event(self, event: Event) -> None:
        event_kind = type(event).KIND
        subject_id = getattr(event, event_kind.topic_field) if event_kind.topic_field else ""
        # the topics of recordings: the uid TYPE::ID of an interface is a path there
        topic = event_kind.topic + subject_id.replace("::", "/", 1)
        if topic not in self._channels:
            self._add_event_channel(topic, type(event))
        # empty for an event without a subject; NUL cannot occur in the names, which are C strings
        subject = "\0".join(str(getattr(event, name)) for name in event_kind.subject_fields)
        self._send_and_store(topic, subject, event.time_us, partial(encode, event))

    def _send_panel_message(self, message: FoxgloveMessage, time_us: int) -> None:
        if message.topic not in self._channels:
            self._add_channel(message.topic, make_json_schema(message.schema_name))
        self._send_and_store(message.topic, message.subject, time_us, message.encode)

    def _send_and_store(self, topic: str, subject: str, time_us: int, encode_message: _Encoder) -> None:
        """Send a message to subscribers, and keep a message about a state.

        :param subject: the subject of the state; empty for a momentary message.
        """
        channel, time_us = self._channels[topic], max(time_us, 0)  # the protocol has unsigned times
        if subject:
            with self._lock:
                states = self._states.setdefault(topic, {})
                # the subject moves to the end, because the limit drops the first subject
                states.pop(subject, None)
                states[subject] = time_us, encode_message
                if len(states) > MAX_STATES_PER_TOPIC:
                    del states[next(iter(states))]
        if channel.has_sinks():
            channel.log(encode_message(), log_time=time_us * 1000)

    def _add_event_channel(self, topic: str, event_type: type[Event]) -> None:
        self._add_channel(
            topic, {**event_json_schema(event_type), "title": f"cxbridge.{event_type.__name__}"}
        )

    def _add_channel(self, topic: str, schema: Mapping[str, Any]) -> None:
        """Create the channel of a topic unless another thread has just created it."""
        with self._lock:
            if topic not in self._channels:
                self._channels[topic] = Channel(topic, schema=dict(schema), context=self._context)
