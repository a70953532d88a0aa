"""A client's open instance on the server's blackboard."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final
from uuid import UUID

from cxbridge.blackboard.listeners import EventKind, MembershipListener
from cxbridge.interfaces.instance import Interface, Message
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.session import FawkesSession


class OpenedInstance(MembershipListener):
    """Forwards the events of a client's instance to the client.

    The client gets no events before OPEN_SUCCESS, which tells the client the serial of the instance and
    includes the data and counts of earlier events. OPEN_SUCCESS does not include messages: a client that
    writes gets earlier messages after OPEN_SUCCESS, with the ends of the readers that may have sent these
    messages.

    :param now_us: returns the time, microseconds since the epoch.
    """

    def __init__(self, instance: Interface, session: FawkesSession, now_us: Callable[[], int]) -> None:
        self.instance: Final = instance
        self.session: Final = session
        self._now_us: Final = now_us
        self._serial: Final = instance.serial.bytes
        self._lock = threading.Lock()
        self._is_announced = False
        self._is_already_sent = True  # whether OPEN_SUCCESS included the write of the present event
        self._sent_write_count = 0  # the number of writes that the client has received
        self._block = b""  # the last block that the client has received
        self._early_frames: list[bytes] = []  # a writer's frames until OPEN_SUCCESS

    def announce(self) -> None:
        """Send OPEN_SUCCESS and the early frames to the client."""
        with self._lock:
            instance = self.instance
            instance.read()
            self._sent_write_count = instance.version_read
            self._block = instance.to_bytes()
            reply = bb.OpenSuccess(instance.serial, instance.has_writer, instance.num_readers, self._block)
            self.session.send(reply.to_bytes())
            self._is_announced = True
            if instance.is_writer:
                self._forward_queued()
                for frame in self._early_frames:
                    self.session.send(frame)
                self._early_frames.clear()

    def data_refreshed(self, interface: Interface) -> None:
        """Send the present data, unless OPEN_SUCCESS included the write."""
        with self._lock:
            if self._is_announced:
                interface.read()
                newest_version = interface.version_read
                self._is_already_sent = newest_version == self._sent_write_count
                if self._is_already_sent:
                    return
                # `newest_version` is smaller after the numbers have restarted from 0
                self._sent_write_count = min(self._sent_write_count + 1, newest_version)
                self._block = block = interface.to_bytes()
                self.session.send_data(self._serial, block, changed=False)

    def data_changed(self, interface: Interface) -> None:  # noqa: ARG002 - a listener's signature
        """Repeat the frame of the same write as changed."""
        with self._lock:
            if self._is_announced and not self._is_already_sent:
                self.session.send_data(self._serial, self._block, changed=True)

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - as above
        """Forward a message to the client's writer; return False, so that the message is not queued here."""
        with self._lock:
            self._forward_queued()
            self._forward(message)
        if not message.enqueued:
            # the client queues the message, so the sender cannot send the message again
            message.mark_enqueued(self._now_us())
        return False

    def _forward_queued(self) -> None:
        """Forward the messages from before the listener was registered."""
        while (queued_message := self.instance.msgq_pop()) is not None:
            self._forward(queued_message)

    def _forward(self, message: Message) -> None:
        serial = self.instance.serial
        source = message.source_id or serial
        frame = bb.WireMessage(
            serial, source, message.type, message.id, message.hops, message.to_bytes()
        ).to_bytes()
        if self._is_announced:
            self.session.send(frame)
        else:
            self._early_frames.append(frame)

    def membership_changed(self, interface: Interface, kind: EventKind, serial: UUID) -> None:
        if serial == interface.serial:
            return  # the client knows by OPEN_SUCCESS that its instance is open
        event = bb.InstanceEvent(bb.BoardKind[kind.name], interface.serial, serial).to_bytes()
        with self._lock:
            if self._is_announced:
                self.session.send(event)
            elif kind is EventKind.READER_REMOVED and interface.is_writer:
                self._early_frames.append(event)
