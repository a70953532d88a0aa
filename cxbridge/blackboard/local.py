"""The blackboard of this process, with one memory for each interface.

The instances of all threads share the memory of their interface. The servers of the transports publish the
blackboard to other processes.
"""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any
from uuid import UUID, uuid4

from cxbridge.blackboard.base import BlackBoard, OpenRequest, Registry
from cxbridge.blackboard.errors import (
    BlackBoardGoneError,
    ForeignInstanceError,
    InvalidInstanceError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.exclusive_control import write_final_block
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.transport import BadUrlError, Transport
from cxbridge.blackboard.listeners import ListenerTable, membership_kind
from cxbridge.blackboard.names import matches
from cxbridge.blackboard.port import BoardPort
from cxbridge.blackboard.publications import REFUSED, emit_message, emit_write
from cxbridge.clock import Clock, join_us
from cxbridge.events import EventBus, Publication
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge.interfaces.message import InstanceIdentity


class InterfaceMemory(BoardPort):
    """One interface of a local blackboard; the port of all its instances.

    The lock guards the lists of instances and orders the writes. The memory releases the lock before it calls
    listeners, so that a listener may open, write and close interfaces.

    :param mem_serial: the number of the memory, unique on the blackboard.
    """

    def __init__(
        self, board: BlackBoard, interface_class: type[Interface], interface_id: str, mem_serial: int
    ) -> None:
        super().__init__(board, interface_class, interface_id, mem_serial)
        self._bus = board.bus
        self._writer: Interface | None = None
        self._readers: dict[UUID, Interface] = {}

    def attach(self, request: OpenRequest, serial: UUID) -> Interface:
        """Make and register an instance.

        :param serial: the serial of the instance.
        :raises WriterActiveError: if the request is for a second writer.
        :raises VersionMismatchError: if the class belongs to another version of the type.
        """
        with self._lock:
            if request.is_writer and self._writer is not None:
                raise WriterActiveError(self.type, self.id, self._writer.owner)
            if request.interface_class.SCHEMA.hash != self.hash:
                raise VersionMismatchError(self.uid, self.hash, request.interface_class.SCHEMA.hash)
            instance = request.make_instance(self, serial)
            if request.is_writer:
                self._writer = instance
            else:
                self._readers[serial] = instance
            return instance

    def detach(self, instance: Interface) -> bool:
        """Remove and invalidate an instance; return whether it belonged to this interface."""
        with self._lock:
            if self._writer is instance:
                self._writer = None
            elif self._readers.get(instance.serial) is instance:
                del self._readers[instance.serial]
            else:
                return False
            instance.invalidate()
            return True

    def has_instance(self, instance: Interface) -> bool:
        return self._writer is instance or self._readers.get(instance.serial) is instance

    @property
    def is_unused(self) -> bool:
        """Whether no instance is open."""
        return self._writer is None and not self._readers

    def instances(self) -> tuple[Interface, ...]:
        """Return the readers in the order of opening, then the writer."""
        with self._lock:
            writer = () if self._writer is None else (self._writer,)
            return (*self._readers.values(), *writer)

    def info(self) -> InterfaceInfo:
        """Return the present description of the interface."""
        with self._lock:
            seconds, microseconds = STAMP.unpack_from(self.snapshot.block)
            return InterfaceInfo(
                type=self.type,
                id=self.id,
                hash=self.hash,
                serial=self.mem_serial,
                has_writer=self._writer is not None,
                writer=self.writer_owner(),
                readers=self.reader_owners(),
                timestamp_us=join_us(seconds, microseconds),
            )

    def values(self) -> dict[str, Any]:
        """Return the present values of the fields by name."""
        view = self.interface_class.VIEW.from_buffer_copy(self.snapshot.block)
        # not strict: READ_FIELDS appends padding values, for which ACCESSORS has no names
        return dict(zip(self.interface_class.ACCESSORS, self.interface_class.READ_FIELDS(view), strict=False))

    def has_writer(self) -> bool:
        return self._writer is not None

    def writer_owner(self) -> str:
        writer = self._writer
        return "" if writer is None else writer.owner

    def reader_owners(self) -> tuple[str, ...]:
        return tuple(reader.owner for reader in tuple(self._readers.values()))

    def reader_owner(self, serial: str) -> str:
        """Return the owner of the reader with a serial; empty if no reader has the serial."""
        readers = tuple(self._readers.values())
        return next((reader.owner for reader in readers if str(reader.serial) == serial), "")

    def publish(
        self, writer: InstanceIdentity, block: bytes | bytearray, stamped: bool | None, changed: bool
    ) -> int:
        """Store the writer's block and notify the listeners.

        :raises InvalidInstanceError: if the writer was closed.
        """
        with self._lock:
            if writer is not self._writer:
                raise InvalidInstanceError(writer.uid, writer.serial, "write()")
            version = self._replace_snapshot(bytes(block), stamped, changed).version
            # listeners that register later read the data and are not notified
            audience = self.listeners.data_audience
        if self._bus is not None and self._bus.wants(Publication):
            emit_write(self._bus, self.now_us(), self.uid, self.hash, block, writer.as_dict)
        if audience is not None:
            self.listeners.notify_data(audience, changed)
        return version

    def transmit(self, sender: Interface, message: Message) -> None:
        """Append a message to the writer's queue, unless a listener handles the message.

        :raises NoWriterError: if the interface has no writer.
        :raises QueueFullError: if the queue is full.
        """
        outcome = REFUSED
        try:
            self._transmit(sender, message)
            outcome = ""  # queued or handled, which the message shows
        finally:
            emit_message(self._bus, self.now_us(), self.uid, sender.owner, message, outcome)

    def _transmit(self, sender: Interface, message: Message) -> None:
        """Transmit a message, without the event on the bus."""
        writer = self._writer
        if writer is not None:
            if not self.listeners.ask_listeners(message):
                return
            # under the lock, because the writer may have been closed while the listeners were called
            with self._lock:
                if writer is self._writer:
                    writer.msgq_append(message)
                    return
        self._board.refuse_message(sender, message)


class LocalBlackBoard(BlackBoard):
    """Interfaces in the memory of this process, for all its threads.

    :param registry: returns the classes of types that are named by a string.
    :param bus: gets log lines, writes and messages.
    :param serials: returns a unique serial for each instance; a counting function makes runs reproducible.
    """

    def __init__(
        self,
        registry: Registry,
        clock: Clock,
        bus: EventBus | None = None,
        *,
        serials: Callable[[], UUID] = uuid4,
    ) -> None:
        super().__init__(registry, clock, bus)
        self._serials = serials
        self._lock = threading.Lock()
        self._memories: dict[tuple[str, str], InterfaceMemory] = {}  # by type and id
        self._mem_serials = itertools.count(1)
        self._is_shut_down = False

    def _open(self, request: OpenRequest) -> Interface:
        key = request.key
        with self._lock:
            if self._is_shut_down:
                raise BlackBoardGoneError
            existing = self._memories.get(key)
            memory = existing or InterfaceMemory(
                self, request.interface_class, request.id, next(self._mem_serials)
            )
            instance = memory.attach(request, self._serials())
            self._memories[key] = memory  # only now: a refused opening creates no interface
        # observers and listeners are called without the lock, because they may use the blackboard
        if existing is None:
            self._observers.notify(*key, created=True)
        memory.listeners.notify(membership_kind(writer=request.is_writer, added=True), instance.serial)
        return instance

    def close(self, instance: Interface) -> None:
        if not instance.valid:
            return
        key = (instance.type, instance.id)
        if instance.is_writer:
            self._write_final_block(instance)
        with self._lock:
            memory = self._memories.get(key)
            if memory is None or not memory.detach(instance):
                raise ForeignInstanceError(instance.uid)
            is_destroyed = memory.is_unused
            if is_destroyed:
                del self._memories[key]
        memory.listeners.notify(membership_kind(writer=instance.is_writer, added=False), instance.serial)
        memory.listeners.unregister(None, instance)
        if is_destroyed:
            self._observers.notify(*key, created=False)

    def _write_final_block(self, writer: Interface) -> None:
        """Write the final block of a writer that is being closed.

        :raises ForeignInstanceError: if the writer belongs to another blackboard.
        """
        self.find_memory(writer)  # a writer of another blackboard would write the block there
        with suppress(InvalidInstanceError):  # another thread has closed the writer
            write_final_block(writer, f"{writer.owner} no longer writes {writer.uid}")

    def shutdown(self) -> None:
        with self._lock:
            self._is_shut_down = True
            for memory in self._memories.values():
                for instance in memory.instances():
                    memory.detach(instance)
            self._memories.clear()

    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        with self._lock:
            memories = tuple(self._memories.values())
        return [memory.info() for memory in memories if matches(memory.type, memory.id, type_glob, id_glob)]

    def memories(self) -> tuple[InterfaceMemory, ...]:
        """Return the memories of all interfaces in the order of their first opening."""
        with self._lock:
            return tuple(self._memories.values())

    def find_memory(self, instance: Interface) -> InterfaceMemory:
        """Return the memory of an instance, for servers of this blackboard.

        :raises ForeignInstanceError: if the instance is not open on this blackboard.
        """
        with self._lock:
            memory = self._memories.get((instance.type, instance.id))
        if memory is None or not memory.has_instance(instance):
            raise ForeignInstanceError(instance.uid)
        return memory

    def _listener_table(self, instance: Interface) -> ListenerTable:
        return self.find_memory(instance).listeners


class LocalTransport(Transport):
    """Opens a new, empty blackboard for the URL ``local:``."""

    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> LocalBlackBoard:
        """Return a new blackboard.

        :param options: arguments of `LocalBlackBoard`.
        :raises BadUrlError: if the URL has more than its scheme.
        """
        if url.partition(":")[2].strip("/"):  # local: and local:// are the same
            raise BadUrlError(f"'{url}' must end after the scheme", hint="write local:")
        return LocalBlackBoard(registry, clock, bus, **options)
