"""An instance that a client has open: forwards its events to the client."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final
from uuid import UUID

from cxbridge.blackboard.fawkesnet.messages import blackboard as bb
from cxbridge.blackboard.fawkesnet.session import FawkesSession
from cxbridge.blackboard.listeners import Listener
from cxbridge.interfaces.instance import Interface, Message


class Opened(Listener):
    """An instance that a client has open; notifies the client of its events.

    Nothing is announced before the client knows the instance: what happens until then is in OPEN_SUCCESS.
    Only a writer is notified afterwards of messages, and of readers that left, who may have sent them.

    :param instance: the instance.
    :param session: the client.
    :param now_us: gives the time.
    """

    def __init__(self, instance: Interface, session: FawkesSession, now_us: Callable[[], int]) -> None:
        self.instance: Final = instance
        self.session: Final = session
        self._now_us: Final = now_us
        self._serial: Final = instance.serial.bytes
        self._lock = threading.Lock()
        self._known = False
        self._repeats = True  # the event being sent now; none has been sent on its own yet
        self._known_writes = 0  # writes that the client knows about
        self._block = b""  # the client's newest
        self._early: list[bytes] = []  # for a writer, before the client knows about it

    def introduce(self) -> None:
        """Notify the client of the instance."""
        with self._lock:
            instance = self.instance
            instance.read()
            self._known_writes = instance.version_read
            self._block = instance.to_bytes()
            opened = bb.OpenSuccess(instance.serial, instance.has_writer, instance.num_readers, self._block)
            self.session.send(opened.to_bytes())
            self._known = True
            if instance.is_writer:
                self._forward_queued()
                for frame in self._early:
                    self.session.send(frame)
                self._early.clear()

    def data_refreshed(self, interface: Interface) -> None:
        """Send the present data."""
        with self._lock:
            if self._known:
                interface.read()
                newest = interface.version_read
                self._repeats = newest == self._known_writes  # of a write that OPEN_SUCCESS had already
                if self._repeats:
                    return
                self._known_writes = min(
                    self._known_writes + 1, newest
                )  # less, when the numbers began from 0 again
                self._block = block = interface.to_bytes()
                self.session.send_data(self._serial, block, changed=False)

    def data_changed(self, interface: Interface) -> None:  # noqa: ARG002 - a listener's signature
        """Repeat the frame of the same write, as changed."""
        with self._lock:
            if self._known and not self._repeats:
                self.session.send_data(self._serial, self._block, changed=True)

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002
        """Send a message on to the client's writer; it never stays in a queue here."""
        with self._lock:
            self._forward_queued()
            self._forward(message)
        if not message.enqueued:
            message.mark_enqueued(self._now_us())  # in the queue at the client: it cannot be sent again
        return False

    def _forward_queued(self) -> None:
        """Forward the events that came before the instance had a handler."""
        while (queued := self.instance.msgq_pop()) is not None:
            self._forward(queued)

    def _forward(self, message: Message) -> None:
        serial = self.instance.serial
        source = message.source_id or serial
        sent = bb.WireMessage(
            serial, source, message.type, message.id, message.hops, message.to_bytes()
        ).to_bytes()
        if self._known:
            self.session.send(sent)
        else:
            self._early.append(sent)

    def reader_added(self, interface: Interface, serial: UUID) -> None:
        """Report a reader."""
        self._send_event(bb.BoardKind.READER_ADDED, interface, serial)

    def reader_removed(self, interface: Interface, serial: UUID) -> None:
        """Report a reader's end."""
        self._send_event(bb.BoardKind.READER_REMOVED, interface, serial)

    def writer_added(self, interface: Interface, serial: UUID) -> None:
        """Report a writer."""
        self._send_event(bb.BoardKind.WRITER_ADDED, interface, serial)

    def writer_removed(self, interface: Interface, serial: UUID) -> None:
        """Report a writer's end."""
        self._send_event(bb.BoardKind.WRITER_REMOVED, interface, serial)

    def _send_event(self, kind: bb.BoardKind, interface: Interface, serial: UUID) -> None:
        if serial == interface.serial:
            return  # its own coming
        event = bb.InstanceEvent(kind, interface.serial, serial).to_bytes()
        with self._lock:
            if self._known:
                self.session.send(event)
            elif kind is bb.BoardKind.READER_REMOVED and interface.is_writer:
                self._early.append(event)
