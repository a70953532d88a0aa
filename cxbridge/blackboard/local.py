"""The blackboard in this process."""

from __future__ import annotations

import itertools
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any
from uuid import UUID, uuid4

from cxbridge.blackboard.base import BlackBoard, Registry
from cxbridge.blackboard.errors import BlackBoardGoneError, ForeignInstanceError, InvalidInstanceError
from cxbridge.blackboard.exclusive_control import write_farewell
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.transport import BadUrlError, Transport
from cxbridge.blackboard.listeners import EventKind, ListenerTable
from cxbridge.blackboard.memory import InterfaceMemory
from cxbridge.blackboard.names import is_plain, matches
from cxbridge.blackboard.opening import OpenRequest
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface


class LocalBlackBoard(BlackBoard):
    """Interfaces in the memory of this process, for all its threads.

    :param registry: gives the classes of types that are named by a string.
    :param clock: gives time stamps.
    :param bus: gets log lines and writes.
    :param serials: makes the serials of instances, each another one; give one that counts for runs that
        repeat to the byte.
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
        self._memories: dict[tuple[str, str], InterfaceMemory] = {}
        self._mem_serials = itertools.count(1)
        self._gone = False

    def _open(self, request: OpenRequest) -> Interface:
        key = request.key
        with self._lock:
            if self._gone:
                raise BlackBoardGoneError
            known = self._memories.get(key)
            memory = known or InterfaceMemory(
                self, request.interface_class, request.id, next(self._mem_serials)
            )
            instance = memory.attach(request, self._serials())
            self._memories[key] = memory
        if known is None:
            self._observers.created(*key)
        event = EventKind.WRITER_ADDED if request.writer else EventKind.READER_ADDED
        memory.listeners.notify(event, instance.serial)
        return instance

    def close(self, instance: Interface) -> None:
        """Close an instance; see the base class."""
        if not instance.valid:
            return
        key = (instance.type, instance.id)
        if instance.is_writer:
            self._take_leave(instance)
        with self._lock:
            memory = self._memories.get(key)
            if memory is None or not memory.detach(instance):
                raise ForeignInstanceError(instance.uid)
            destroyed = memory.unused
            if destroyed:
                del self._memories[key]
        event = EventKind.WRITER_REMOVED if instance.is_writer else EventKind.READER_REMOVED
        memory.listeners.notify(event, instance.serial)
        memory.listeners.unregister(None, instance)
        if destroyed:
            self._observers.destroyed(*key)

    def _take_leave(self, writer: Interface) -> None:
        """Write the last block of a writer.

        :raises ForeignInstanceError: when the writer is not open on this blackboard.
        """
        self.memory_of(writer)
        with suppress(InvalidInstanceError):  # another thread has closed the writer
            write_farewell(writer, f"{writer.owner} does not write {writer.uid} any more")

    def shutdown(self) -> None:
        """Make all instances invalid and refuse to open more."""
        with self._lock:
            self._gone = True
            for memory in self._memories.values():
                for instance in memory.instances():
                    memory.detach(instance)
            self._memories.clear()

    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        """Return a description of the interfaces that match; see the base class."""
        with self._lock:
            if is_plain(type_glob) and is_plain(id_glob):
                found = self._memories.get((type_glob, id_glob))
                memories: tuple[InterfaceMemory, ...] = () if found is None else (found,)
            else:
                memories = tuple(self._memories.values())
        return [memory.info() for memory in memories if matches(memory.type, memory.id, type_glob, id_glob)]

    def memories(self) -> tuple[InterfaceMemory, ...]:
        """Return the shared memories of all interfaces, in the order in which they were opened first."""
        with self._lock:
            return tuple(self._memories.values())

    def memory_of(self, instance: Interface) -> InterfaceMemory:
        """Return the shared memory of an instance; for servers of this blackboard.

        :raises ForeignInstanceError: when the instance is not open on this blackboard.
        """
        with self._lock:
            memory = self._memories.get((instance.type, instance.id))
        if memory is None or not memory.has(instance):
            raise ForeignInstanceError(instance.uid)
        return memory

    def _listeners_of(self, instance: Interface) -> ListenerTable:
        return self.memory_of(instance).listeners


class LocalTransport(Transport):
    """Opens a new, empty blackboard in this process, by ``local:``."""

    def open(
        self, url: str, registry: Registry, clock: Clock, bus: EventBus | None, **options: Any
    ) -> LocalBlackBoard:
        """Return a new blackboard.

        :param options: those of :class:`LocalBlackBoard`.
        :raises BlackBoardError: when the URL is more than ``local:``.
        """
        if url.partition(":")[2].strip("/"):
            raise BadUrlError(f"'{url}' has more than a local blackboard needs", hint="write local:")
        return LocalBlackBoard(registry, clock, bus, **options)
