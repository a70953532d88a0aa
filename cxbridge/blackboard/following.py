"""Waiting for events of interfaces in the thread of a command such as ``bb watch``.

A blackboard calls listeners in the thread of a write or in a separate thread, but a command waits in the
main thread. A feed queues the events for the command, with the values of the interface at the time of the
event.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any
from uuid import UUID

from cxbridge.blackboard import BlackBoard, EventKind, Listener, Observer, listening
from cxbridge.closing import Closing
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import Interface

_FOLLOWED_KINDS = (EventKind.DATA_REFRESHED, EventKind.WRITER_ADDED, EventKind.WRITER_REMOVED)


@dataclass(frozen=True, slots=True)
class InterfaceChange:
    """An event of an interface.

    :param uid: ``Type::id``.
    :param kind: ``data``, ``writer added`` or ``writer removed``.
    :param time_us: the data's time stamp, microseconds since the epoch.
    :param values: the values of the fields by name.
    """

    uid: str
    kind: str
    time_us: int
    values: dict[str, Any]


class Deadline:
    """The end of a wait, in real time.

    :param seconds: the seconds from now; None: the wait has no limit.
    """

    def __init__(self, seconds: float | None) -> None:
        self._end_s = None if seconds is None else time.monotonic() + seconds

    def remaining_s(self) -> float | None:
        """Return the remaining seconds, at least 0; None if the wait has no limit."""
        return None if self._end_s is None else max(0.0, self._end_s - time.monotonic())


class Feed(Listener, Observer, Closing):
    """Events of interfaces, in order. As a context manager, it closes its instances.

    :param board: the blackboard, which stays open.
    :param owner: the owner of the instances that the feed opens.
    """

    def __init__(self, board: BlackBoard, owner: str) -> None:
        self._board = board
        self._owner = owner
        # changes, and for each created interface its type and id
        self._events: queue.SimpleQueue[InterfaceChange | tuple[str, str]] = queue.SimpleQueue()
        self._lock = threading.Lock()  # guards the copies of the instances: listeners read in any thread
        self._instances: dict[tuple[str, str], Interface] = {}  # by type and id

    def open(self, interface_type: str, interface_id: str) -> Interface:
        """Open an interface for reading and follow its events.

        Callers must read the values from the events: the feed's listeners overwrite the instance's copy at
        any time.

        :raises BlackBoardError: if the interface cannot be opened.
        """
        existing = self._instances.get((interface_type, interface_id))
        if existing is not None and existing.valid:
            return existing
        instance = self._board.open_for_reading(
            interface_type, interface_id, owner=self._owner, listen=listening(self, *_FOLLOWED_KINDS)
        )
        self._instances[interface_type, interface_id] = instance
        with self._lock:
            instance.read()
        return instance

    @property
    def instances(self) -> Sequence[Interface]:
        """The followed interfaces in the order of opening."""
        return tuple(self._instances.values())

    def follow(self, type_glob: str, id_glob: str) -> Sequence[Interface]:
        """Follow all matching interfaces; return the present ones, opened.

        :meth:`wait_for_change` opens the interfaces that are created later.

        :raises BlackBoardError: if an interface cannot be opened.
        """
        # the observer first: an interface that is created in between is in the list, too, and opened once
        self._board.register_observer(self, type_glob, id_glob)
        return [self.open(info.type, info.id) for info in self._board.list(type_glob, id_glob)]

    def read_state(self, instance: Interface) -> InterfaceChange:
        """Return the present state of an opened interface, as a change of its data."""
        with self._lock:
            instance.read()
            return InterfaceChange(instance.uid, "data", instance.timestamp_us, instance.as_dict())

    def wait_for_change(self, deadline: Deadline) -> InterfaceChange | None:
        """Wait for an event; return None after the deadline.

        :raises BlackBoardError: if an interface that was created during the wait cannot be opened.
        """
        while True:
            try:
                event = self._events.get(timeout=deadline.remaining_s())
            except queue.Empty:
                return None
            if isinstance(event, InterfaceChange):
                return event
            if event not in self._instances:
                instance = self.open(*event)
                # a time stamp of 0: the interface has no data yet, and its first write will be an event
                if instance.timestamp_us:
                    return self.read_state(instance)

    def close(self) -> None:
        self._board.unregister_observer(self)
        for instance in self._instances.values():
            if instance.valid:
                instance.close()
        self._instances.clear()

    def data_refreshed(self, interface: Interface) -> None:
        self._queue_change(interface, "data")

    def writer_added(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - a listener's signature
        self._queue_change(interface, "writer added")

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._queue_change(interface, "writer removed")

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        """Queue the name of an interface, which the waiting thread opens."""
        self._events.put((interface_type, interface_id))

    def _queue_change(self, interface: Interface, kind: str) -> None:
        with self._lock:
            if not interface.valid:
                return
            try:
                interface.read()
            except BlackBoardError:
                return  # the interface was closed after the check
            self._events.put(
                InterfaceChange(interface.uid, kind, interface.timestamp_us, interface.as_dict())
            )
