"""A listener and observer that records all events."""

from __future__ import annotations

from uuid import UUID

from cxbridge.blackboard import Listener, Observer
from cxbridge.interfaces.instance import Interface, Message


class Recorder(Listener, Observer):
    """Records all events in ``log``."""

    def __init__(self, log: list[tuple[object, ...]] | None = None) -> None:
        self.log = [] if log is None else log

    def data_refreshed(self, interface: Interface) -> None:
        self.log.append(("refreshed", interface.uid))

    def data_changed(self, interface: Interface) -> None:
        self.log.append(("changed", interface.uid))

    def message_received(self, interface: Interface, message: Message) -> bool:
        self.log.append(("message", interface.uid, message.type))
        return True

    def reader_added(self, interface: Interface, serial: UUID) -> None:
        self.log.append(("+reader", interface.uid, serial))

    def reader_removed(self, interface: Interface, serial: UUID) -> None:
        self.log.append(("-reader", interface.uid, serial))

    def writer_added(self, interface: Interface, serial: UUID) -> None:
        self.log.append(("+writer", interface.uid, serial))

    def writer_removed(self, interface: Interface, serial: UUID) -> None:
        self.log.append(("-writer", interface.uid, serial))

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        self.log.append(("created", f"{interface_type}::{interface_id}"))

    def interface_destroyed(self, interface_type: str, interface_id: str) -> None:
        self.log.append(("destroyed", f"{interface_type}::{interface_id}"))

    def take(self) -> list[tuple[object, ...]]:
        """Return the recorded events and clear the log."""
        taken, self.log[:] = list(self.log), []
        return taken
