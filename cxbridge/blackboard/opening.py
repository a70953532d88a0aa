"""A request to open an interface: its class and id, the owner, and how it is to be opened."""

from __future__ import annotations

from typing import Protocol
from uuid import UUID

from msgspec import Struct

from cxbridge.blackboard.listeners import Listen, ListenerTable
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.port import Port


class ListenedPort(Port[Interface], Protocol):
    """The port of an interface that has listeners."""

    @property
    def listeners(self) -> ListenerTable:
        """The listeners of the interface."""


class OpenRequest(Struct, frozen=True):
    """An interface to open; its names are checked.

    :param owner: the name of the opener, for lists and messages to people.
    :param queue_limit: how many messages may wait, of a writer; None: 1,024.
    :param listen: called with the instance before any other code can see it.
    """

    interface_class: type[Interface]
    id: str
    owner: str = ""
    writer: bool = False
    queue_limit: int | None = None
    listen: Listen | None = None

    @property
    def type(self) -> str:
        """The type of the interface."""
        return self.interface_class.SCHEMA.name

    @property
    def uid(self) -> str:
        """``Type::id``."""
        return f"{self.type}::{self.id}"

    @property
    def key(self) -> tuple[str, str]:
        """Type and id."""
        return self.type, self.id

    def make_instance(self, port: ListenedPort, serial: UUID) -> Interface:
        """Make the instance, with the listeners it is to have from the beginning."""
        instance = self.interface_class(
            port,
            id=self.id,
            owner=self.owner,
            serial=serial,
            writer=self.writer,
            queue_limit=self.queue_limit,
        )
        if self.listen is not None:
            self.listen(instance, port.listeners)
        return instance
