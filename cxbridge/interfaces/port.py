"""The port of an opened interface: its connection to the blackboard, whichever that is."""

# ruff: noqa: ARG002, D102 - the closed port repeats the open one

from __future__ import annotations

from typing import Protocol, TypeVar
from uuid import UUID

from cxbridge.interfaces.instance_errors import InvalidInstanceError
from cxbridge.interfaces.message import Message

InstanceT_contra = TypeVar("InstanceT_contra", contravariant=True)
"""The type of the instances that a blackboard opens: :class:`~cxbridge.interfaces.instance.Interface`."""


class OpenedBlock(Protocol):
    """The identity of an instance."""

    @property
    def uid(self) -> str:
        """``Type::id``."""

    @property
    def serial(self) -> UUID:
        """Unique to the instance."""


class Port(Protocol[InstanceT_contra]):
    """What an instance asks of the blackboard that opened it."""

    @property
    def version(self) -> int:
        """How often the shared block was written. Read without a lock, to see whether a read is worth it."""

    @property
    def mem_serial(self) -> int:
        """Number of the shared memory on its blackboard."""

    def now_us(self) -> int:
        """Return the time of the blackboard's clock, microseconds since the epoch."""

    def fetch(self, into: bytearray) -> tuple[int, int, int]:
        """Copy the shared block.

        :returns: its version, the version that last got a time stamp, the version that last had changed data.
        """

    def publish(self, writer: OpenedBlock, block: bytearray, stamped: bool | None, changed: bool) -> int:
        """Copy the writer's private block to the shared one and notify the listeners.

        :param block: the private block, of the size of the shared one.
        :param stamped: the block carries a new time stamp; None: only a comparison can tell.
        :param changed: a setter changed a value since the write before.
        :returns: the new version.
        """

    def next_id(self, last: int) -> int:
        """Return the id of the next message of an instance.

        :param last: the id of its last one; 0: there was none.
        """

    def next_id_is_stale(self, last: int) -> bool:
        """Return whether the next message gets an id that is not a message's, or an earlier one's.

        :param last: the id of the instance's last one; 0: there was none.
        """

    def transmit(self, sender: InstanceT_contra, message: Message) -> None:
        """Carry an addressed message to the writer.

        :raises BlackBoardError: when there is no writer, or it cannot take the message.
        """

    def writer_owner(self) -> str:
        """Return the name of the writer of the interface; empty without a writer."""

    def has_writer(self) -> bool:
        """Return whether the interface has a writer."""

    def reader_owners(self) -> tuple[str, ...]:
        """Return who has the interface open for reading, in the order of opening."""

    def reader_owner(self, serial: str) -> str:
        """Return who has opened the reading instance with this serial; empty when that is not known."""

    def close(self, instance: InstanceT_contra) -> None:
        """Take the instance off the blackboard."""


class ClosedPort:
    """The port of an instance that is closed: refuses everything but closing."""

    __slots__ = ("_serial", "_uid")

    version = -3  # equal to no instance's: a read always comes to fetch
    mem_serial = 0

    def __init__(self, uid: str, serial: UUID) -> None:
        self._uid = uid
        self._serial = serial

    def _refuse(self, operation: str) -> InvalidInstanceError:
        return InvalidInstanceError(self._uid, self._serial, operation)

    def now_us(self) -> int:
        raise self._refuse("write()")

    def fetch(self, into: bytearray) -> tuple[int, int, int]:
        raise self._refuse("read()")

    def publish(self, writer: OpenedBlock, block: bytearray, stamped: bool | None, changed: bool) -> int:
        raise self._refuse("write()")

    def next_id(self, last: int) -> int:
        raise self._refuse("msgq_enqueue()")

    def next_id_is_stale(self, last: int) -> bool:
        raise self._refuse("msgq_enqueue()")

    def transmit(self, sender: object, message: Message) -> None:
        raise self._refuse("msgq_enqueue()")

    def writer_owner(self) -> str:
        raise self._refuse("writer()")

    def has_writer(self) -> bool:
        raise self._refuse("has_writer()")

    def reader_owners(self) -> tuple[str, ...]:
        raise self._refuse("readers()")

    def reader_owner(self, serial: str) -> str:
        raise self._refuse("reader_owner()")

    def close(self, instance: object) -> None:
        pass
