"""Remote writes and messages as events on the bus."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any, Final

from cxbridge.blackboard.fawkesnet.client.port import NOBODY, RemotePort
from cxbridge.blackboard.publications import SENT, emit_message, emit_write
from cxbridge.events import EventBus, Publication
from cxbridge.interfaces.message import ClosedPort, Message


class PublicationEmitter:
    """Emits each write once, even if several instances receive it.

    :param bus: receives the events; None: no events.
    :param now_us: returns the time.
    :param ports: returns the ports of all open instances, oldest first.
    """

    def __init__(
        self, bus: EventBus | None, now_us: Callable[[], int], ports: Callable[[], Iterable[RemotePort]]
    ) -> None:
        self._bus: Final = bus
        self._now_us: Final = now_us
        self._ports: Final = ports

    def emit_write(self, port: RemotePort, block: bytes) -> None:
        """Emit a written or received block if ``port`` reports for its interface."""
        bus = self._bus
        if bus is None or not bus.wants(Publication) or not self._speaks(port):
            return

        def values() -> dict[str, Any]:
            instance = port.interface_class(
                ClosedPort(port.uid, NOBODY), id=port.id, owner="", serial=NOBODY, writer=False
            )
            instance.set_from_chunk(block)
            return instance.as_dict()

        emit_write(bus, self._now_us(), port.uid, port.hash, block, values)

    def emit_message(self, port: RemotePort, message: Message, outcome: str = "") -> None:
        """Emit a received message, or one that is being sent."""
        # a message to a writer of this client comes back and is emitted then
        own = outcome != SENT or not any(
            other.uid == port.uid and other.instance.is_writer for other in self._ports()
        )
        if own:
            sender = "" if port.instance.is_writer else port.instance.owner
            emit_message(self._bus, self._now_us(), port.uid, sender, message, outcome)

    def _speaks(self, port: RemotePort) -> bool:
        """Return whether the port reports for its interface: the writer's port, else the oldest."""
        same = [other for other in self._ports() if other.uid == port.uid]
        writers = [other for other in same if other.instance.is_writer]
        return bool(same) and (writers or same)[0] is port
