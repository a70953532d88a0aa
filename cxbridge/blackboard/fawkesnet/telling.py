"""Tells the event bus of the writes of remote interfaces, and of messages to their writers."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from cxbridge.blackboard.fawkesnet.remote_port import NOBODY, RemotePort
from cxbridge.blackboard.message_telling import SENT, tell_message
from cxbridge.events import BlockWrite, EventBus, InterfaceWrite, Publication
from cxbridge.interfaces.message import Message
from cxbridge.interfaces.port import ClosedPort


class WriteTeller:
    """Emits each write once, however many instances of the interface get it.

    :param bus: takes the events; None: nobody does.
    :param now_us: tells the time.
    :param ports: returns the ports of all open instances, the oldest first.
    """

    def __init__(
        self, bus: EventBus | None, now_us: Callable[[], int], ports: Callable[[], Iterable[RemotePort]]
    ) -> None:
        self._bus: Final = bus
        self._now_us: Final = now_us
        self._ports: Final = ports

    def tell(self, port: RemotePort, block: bytes) -> None:
        """Tell of a block that was written or received, if ``port`` is the one to tell."""
        bus = self._bus
        if bus is None or not bus.wants(Publication) or not self._speaks(port):
            return
        time_us = self._now_us()
        if bus.wants(InterfaceWrite):
            values = port.interface_class(
                ClosedPort(port.uid, NOBODY), id=port.id, owner="", serial=NOBODY, writer=False
            )
            values.set_from_chunk(block)
            bus.emit(InterfaceWrite(time_us, port.uid, values.as_dict()))
        if bus.wants(BlockWrite):
            bus.emit(BlockWrite(time_us, port.uid, port.interface_class.SCHEMA.hash, block))

    def tell_message(self, port: RemotePort, message: Message, outcome: str = "") -> None:
        """Tell of a message that was received, or is on its way to the other end.

        What is sent to a writer of this client comes back, and is told then.
        """
        own = outcome != SENT or not any(
            other.uid == port.uid and other.instance.is_writer for other in self._ports()
        )
        if own:
            sender = "" if port.instance.is_writer else port.instance.owner
            tell_message(self._bus, self._now_us(), port.uid, sender, message, outcome)

    def _speaks(self, port: RemotePort) -> bool:
        """Whether this one tells for its interface: that of the writer, else the oldest."""
        same = [other for other in self._ports() if other.uid == port.uid]
        writers = [other for other in same if other.instance.is_writer]
        return bool(same) and (writers or same)[0] is port
