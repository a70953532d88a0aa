"""The network logger component: log lines for Fawkes' log viewers."""

from __future__ import annotations

from typing import ClassVar, Final

from cxbridge.events import Event, EventBus, LogLine
from cxbridge.printing import indent_lines, one_line
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.messages.logger import LogKind, LogMessage
from cxbridge_fawkes.network.session import FawkesSession, NetworkHandler


class NetworkLogger(NetworkHandler):
    """Sends log lines from any thread to subscribed clients.

    :param bus: the bus of the log lines; the component subscribes only while it has clients.
    """

    COMPONENT: ClassVar[ComponentId] = ComponentId.NETWORK_LOGGER

    def __init__(self, bus: EventBus) -> None:
        self._bus: Final = bus
        self._subscribers: frozenset[FawkesSession] = frozenset()

    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        """Subscribe or unsubscribe a client.

        :raises MalformedMessageError: if the kind of the request is unknown.
        """
        match frame.kind:
            case LogKind.SUBSCRIBE:
                self._set_subscribers(self._subscribers | {session})
            case LogKind.UNSUBSCRIBE:
                self._set_subscribers(self._subscribers - {session})
            case _:
                raise MalformedMessageError(f"the network logger has no requests of kind {frame.kind}")

    def disconnected(self, session: FawkesSession) -> None:
        self._set_subscribers(self._subscribers - {session})

    def stop(self) -> None:
        self._set_subscribers(frozenset())

    def _set_subscribers(self, subscribers: frozenset[FawkesSession]) -> None:
        # the set is replaced, never changed, because `_forward` iterates over it in any thread
        previous_subscribers, self._subscribers = self._subscribers, subscribers
        if subscribers and not previous_subscribers:
            self._bus.subscribe(self._forward, LogLine)
        elif previous_subscribers and not subscribers:
            self._bus.unsubscribe(self._forward)

    def _forward(self, event: Event) -> None:
        assert isinstance(event, LogLine)
        # Fawkes' viewers print received lines unescaped to the terminal
        text, component = indent_lines(event.text), one_line(event.component)
        frame = LogMessage(event.time_us, event.level, component, text).to_bytes()
        for session in self._subscribers:
            session.send(frame)
