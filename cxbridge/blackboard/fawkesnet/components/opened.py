"""A client's open instance, whose events are forwarded to the client."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final
from uuid import UUID

from cxbridge.blackboard.fawkesnet.messages import blackboard as bb
from cxbridge.blackboard.fawkesnet.session import FawkesSession
from cxbridge.blackboard.listeners import EventKind, MembershipListener
from cxbridge.interfaces.instance import Interface, Message


class OpenedInstance(MembershipListener):
    """A client's open instance, which forwards events.

    Nothing is sent before the client knows the instance: OPEN_SUCCESS includes the earlier events. Only a
    writer also gets the earlier messages, and the ends of readers that may have sent them.

    :param session: the session of the client.
    :param now_us: returns the time.
    """

    def __init__(self, instance: Interface, session: FawkesSession, now_us: Callable[[], int]) -> None:
        self.instance: Final = instance
        self.session: Final = session
        self._now_us: Final = now_us
        self._serial: Final = instance.serial.bytes
        self._lock = threading.Lock()
        self._introduced = False
        self._repeats = True  # whether the present event was already sent, in OPEN_SUCCESS
        self._sent_writes = 0  # the number of writes that the client has received
        self._block = b""  # the newest block that the client has received
        self._early_frames: list[bytes] = []  # a writer's frames from before the client knows the instance

    def introduce(self) -> None:
        """Send the instance to the client."""
        with self._lock:
            instance = self.instance
            instance.read()
            self._sent_writes = instance.version_read
            self._block = instance.to_bytes()
            opened = bb.OpenSuccess(instance.serial, instance.has_writer, instance.num_readers, self._block)
            self.session.send(opened.to_bytes())
            self._introduced = True
            if instance.is_writer:
                self._forward_queued()
                for frame in self._early_frames:
                    self.session.send(frame)
                self._early_frames.clear()

    def data_refreshed(self, interface: Interface) -> None:
        """Send the present data."""
        with self._lock:
            if self._introduced:
                interface.read()
                newest = interface.version_read
                # the event of a write that OPEN_SUCCESS included
                self._repeats = newest == self._sent_writes
                if self._repeats:
                    return
                # `newest` is smaller after the numbers have restarted from 0
                self._sent_writes = min(self._sent_writes + 1, newest)
                self._block = block = interface.to_bytes()
                self.session.send_data(self._serial, block, changed=False)

    def data_changed(self, interface: Interface) -> None:  # noqa: ARG002 - a listener's signature
        """Repeat the frame of the same write as changed."""
        with self._lock:
            if self._introduced and not self._repeats:
                self.session.send_data(self._serial, self._block, changed=True)

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002
        """Forward a message to the client's writer, without queuing it here."""
        with self._lock:
            self._forward_queued()
            self._forward(message)
        if not message.enqueued:
            message.mark_enqueued(self._now_us())  # it is in the client's queue and cannot be sent again
        return False

    def _forward_queued(self) -> None:
        """Forward the messages from before the listener was registered."""
        while (queued := self.instance.msgq_pop()) is not None:
            self._forward(queued)

    def _forward(self, message: Message) -> None:
        serial = self.instance.serial
        source = message.source_id or serial
        sent = bb.WireMessage(
            serial, source, message.type, message.id, message.hops, message.to_bytes()
        ).to_bytes()
        if self._introduced:
            self.session.send(sent)
        else:
            self._early_frames.append(sent)

    def membership_changed(self, interface: Interface, kind: EventKind, serial: UUID) -> None:
        """Send the event, unless it is that of this instance itself."""
        if serial == interface.serial:
            return
        event = bb.InstanceEvent(bb.BoardKind[kind.name], interface.serial, serial).to_bytes()
        with self._lock:
            if self._introduced:
                self.session.send(event)
            elif kind is EventKind.READER_REMOVED and interface.is_writer:
                self._early_frames.append(event)
