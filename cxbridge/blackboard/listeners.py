"""Listeners of interfaces and observers of a blackboard, and the tables that notify them.

A blackboard calls listeners and observers in the thread of the event without a lock, so a listener may use
the blackboard. Tables replace their tuples of registrations: registrations do not disturb a notification that
has begun.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from enum import StrEnum
from typing import Final
from uuid import UUID

from msgspec import Struct

from cxbridge.blackboard.names import matches
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import Interface, Message


class Observer:
    """Base of observers, which are notified of interfaces that are created and destroyed.

    An observer overrides the first two methods, or the third one for both events.
    """

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        """Handle the opening of an interface's first instance."""
        self.existence_changed(interface_type, interface_id, created=True)

    def interface_destroyed(self, interface_type: str, interface_id: str) -> None:
        """Handle the closing of an interface's last instance, with which its data are lost."""
        self.existence_changed(interface_type, interface_id, created=False)

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:
        """Handle the creation or the end of an interface."""


class _ObserverRegistration(Struct, eq=False):
    observer: Observer
    type_glob: str
    id_glob: str
    active: bool = True


Report = Callable[[str, Exception], None]
"""Takes the operation in which a listener or observer failed, and the error."""


class ObserverTable:
    """The observers of a blackboard.

    :param report: called with the operation and error of a failed observer.
    """

    __slots__ = ("_lock", "_registrations", "_report")

    def __init__(self, report: Report) -> None:
        self._report: Final = report
        self._lock = threading.Lock()
        self._registrations: tuple[_ObserverRegistration, ...] = ()

    def register(self, observer: Observer, type_glob: str, id_glob: str) -> None:
        """Notify ``observer`` of interfaces that match both shell patterns."""
        with self._lock:
            self._registrations = (*self._registrations, _ObserverRegistration(observer, type_glob, id_glob))

    def unregister(self, observer: Observer) -> None:
        with self._lock:
            for registration in self._registrations:
                # a notification in another thread may still hold the registration
                registration.active &= registration.observer is not observer
            self._registrations = tuple(
                registration for registration in self._registrations if registration.active
            )

    def notify_created(self, interface_type: str, interface_id: str) -> None:
        """Notify the observers of a new interface."""
        for registration in self._select(interface_type, interface_id):
            self._deliver(registration, registration.observer.interface_created, interface_type, interface_id)

    def notify_destroyed(self, interface_type: str, interface_id: str) -> None:
        """Notify the observers of a destroyed interface."""
        for registration in self._select(interface_type, interface_id):
            self._deliver(
                registration, registration.observer.interface_destroyed, interface_type, interface_id
            )

    def _select(self, interface_type: str, interface_id: str) -> list[_ObserverRegistration]:
        """Return one registration per observer, even if several of its patterns match."""
        selected: dict[int, _ObserverRegistration] = {}
        for registration in self._registrations:
            if matches(interface_type, interface_id, registration.type_glob, registration.id_glob):
                selected.setdefault(id(registration.observer), registration)
        return list(selected.values())

    def _deliver(
        self, registration: _ObserverRegistration, call: Callable[[str, str], None], *names: str
    ) -> None:
        if registration.active:
            try:
                call(*names)
            except Exception as error:  # noqa: BLE001 - an observer's fault is not the caller's
                self._report(f"{call.__name__} of {'::'.join(names)}", error)


class EventKind(StrEnum):
    """Kinds of events of an interface; the value is the name of the listener's method."""

    DATA_REFRESHED = "data_refreshed"
    DATA_CHANGED = "data_changed"
    MESSAGE_RECEIVED = "message_received"
    READER_ADDED = "reader_added"
    READER_REMOVED = "reader_removed"
    WRITER_ADDED = "writer_added"
    WRITER_REMOVED = "writer_removed"


class Listener:
    """Base of listeners, which override the methods of the events that they handle.

    The first argument is always the instance for which the listener was registered. Its private copy holds
    the data of the last read.
    """

    def data_refreshed(self, interface: Interface) -> None:
        """Handle a write; called before `data_changed` of the same write."""

    def data_changed(self, interface: Interface) -> None:
        """Handle a write that changed data."""

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - for subclasses
        """Handle a message before it is queued.

        :returns: whether the message goes to the next listener, and finally into the writer's queue.
        """
        return True

    def reader_added(self, interface: Interface, serial: UUID) -> None:
        """Handle the opening of a reading instance."""

    def reader_removed(self, interface: Interface, serial: UUID) -> None:
        """Handle the closing of a reading instance."""

    def writer_added(self, interface: Interface, serial: UUID) -> None:
        """Handle the opening of the writing instance."""

    def writer_removed(self, interface: Interface, serial: UUID) -> None:
        """Handle the closing of the writing instance; its data remain."""


class MembershipListener(Listener):
    """Base of listeners that handle the openings and closings of instances in one method."""

    def membership_changed(self, interface: Interface, kind: EventKind, serial: UUID) -> None:
        """Handle the opening or closing of an instance.

        :param kind: ``READER_ADDED`` to ``WRITER_REMOVED``.
        :param serial: the opened or closed instance.
        """

    def reader_added(self, interface: Interface, serial: UUID) -> None:
        self.membership_changed(interface, EventKind.READER_ADDED, serial)

    def reader_removed(self, interface: Interface, serial: UUID) -> None:
        self.membership_changed(interface, EventKind.READER_REMOVED, serial)

    def writer_added(self, interface: Interface, serial: UUID) -> None:
        self.membership_changed(interface, EventKind.WRITER_ADDED, serial)

    def writer_removed(self, interface: Interface, serial: UUID) -> None:
        self.membership_changed(interface, EventKind.WRITER_REMOVED, serial)


MEMBERSHIP_KINDS: Final = (
    EventKind.READER_ADDED,
    EventKind.READER_REMOVED,
    EventKind.WRITER_ADDED,
    EventKind.WRITER_REMOVED,
)
"""The events of openings and closings."""


def membership_kind(*, writer: bool, added: bool) -> EventKind:
    """Return the event of an opened (``added``) or closed instance."""
    # MEMBERSHIP_KINDS lists the readers first, and the opening before the closing
    return MEMBERSHIP_KINDS[2 * writer + (not added)]


class _Registration(Struct, eq=False):
    listener: Listener
    instance: Interface
    call: Callable[..., bool | None]
    active: bool = True


def overridden_kinds(listener: Listener, *, messages: bool) -> tuple[EventKind, ...]:
    """Return the kinds of events whose method is overridden in the listener's class or instance.

    :param messages: whether to include messages.
    """
    return tuple(
        kind
        for kind in EventKind
        if (messages or kind is not EventKind.MESSAGE_RECEIVED)
        and getattr(getattr(listener, kind), "__func__", None) is not getattr(Listener, kind)
    )


Audience = tuple[_Registration, ...]
"""The registrations to notify of an event."""

DataAudience = tuple[Audience, Audience]
"""The registrations to notify of a write, and those to notify of a changing write."""


class ListenerTable:
    """The listeners of an interface.

    The tuples of registrations are replaced, never changed, so a delivery iterates over the tuple with which
    it began.

    :param report: called with the operation and error of a failed listener.
    """

    __slots__ = ("_entries", "_keys", "_lock", "_report", "data_audience")

    def __init__(self, report: Report) -> None:
        self._report: Final = report
        self._lock = threading.Lock()
        self._entries: dict[str, tuple[_Registration, ...]] = {}
        self._keys: set[tuple[str, int, int]] = set()  # kind, listener and instance of each entry
        # computed at registration, because it is read at each write
        self.data_audience: DataAudience | None = None
        """The listeners of writes, None if there are none."""

    def register(self, listener: Listener, instance: Interface, kinds: tuple[EventKind, ...]) -> None:
        """Register a listener of an instance; a repeated registration has no effect."""
        with self._lock:
            for kind in kinds:
                key = (kind, id(listener), id(instance))  # listeners need not be hashable
                if key not in self._keys:
                    self._keys.add(key)
                    entry = _Registration(listener, instance, getattr(listener, kind))
                    self._entries[kind] = (*self._entries.get(kind, ()), entry)
            self._update_data_audience()

    def unregister(self, listener: Listener | None, instance: Interface | None) -> bool:
        """Remove registrations and return whether there were any; None matches all."""
        removed = False
        with self._lock:
            for kind, entries in list(self._entries.items()):
                remaining = []
                for entry in entries:
                    if listener in (None, entry.listener) and instance in (None, entry.instance):
                        entry.active = False  # a delivery in another thread may still hold the entry
                        self._keys.discard((kind, id(entry.listener), id(entry.instance)))
                        removed = True
                    else:
                        remaining.append(entry)
                self._entries[kind] = tuple(remaining)
            self._update_data_audience()
        return removed

    def _update_data_audience(self) -> None:
        refreshed = self._entries.get(EventKind.DATA_REFRESHED, ())
        altered = self._entries.get(EventKind.DATA_CHANGED, ())
        self.data_audience = (refreshed, altered) if refreshed or altered else None

    def notify_data(self, audience: DataAudience, changed: bool) -> None:
        """Notify the active listeners of a write."""
        refreshed, altered = audience
        if refreshed:
            self.notify_audience(refreshed, EventKind.DATA_REFRESHED)
        if changed and altered:
            self.notify_audience(altered, EventKind.DATA_CHANGED)

    def notify(self, kind: EventKind, *args: UUID) -> None:
        """Notify all listeners of an event, in the order of registration."""
        self.notify_audience(self.audience(kind), kind, *args)

    def audience(self, kind: EventKind) -> Audience:
        """Return the present registrations for an event that is delivered later."""
        return self._entries.get(kind, ())

    def notify_audience(self, audience: Audience, kind: EventKind, *args: UUID) -> None:
        """Notify the active listeners of ``audience``."""
        for entry in audience:
            if entry.active:
                try:
                    entry.call(entry.instance, *args)
                except Exception as error:  # noqa: BLE001 - a listener's fault is not the caller's
                    self._report(f"{kind} of {entry.instance.uid}", error)

    def accept(self, message: Message) -> bool:
        """Ask the listeners whether a message is queued; the first refusal decides.

        A listener that fails does not count as a refusal.
        """
        for entry in self._entries.get(EventKind.MESSAGE_RECEIVED, ()):
            if entry.active:
                try:
                    if entry.call(entry.instance, message) is False:
                        return False
                except Exception as error:  # noqa: BLE001 - a listener's fault is not the sender's
                    self._report(f"message_received of {entry.instance.uid}", error)
        return True


Listen = Callable[[Interface, ListenerTable], None]
"""Registers listeners of an instance in the table of its interface."""


def listening(listener: Listener, *kinds: EventKind) -> Listen:
    """Return a function that registers a listener while its instance is being opened.

    A listener that is registered later misses earlier events: messages wait in the queue, and openings and
    closings are not announced. The listener must use the instance in its arguments, because no variable holds
    it before opening returns.

    :param kinds: as in :meth:`~cxbridge.blackboard.base.BlackBoard.register_listener`.
    """

    def listen(instance: Interface, table: ListenerTable) -> None:
        events = kinds or overridden_kinds(listener, messages=instance.is_writer)
        if EventKind.MESSAGE_RECEIVED in events and not instance.is_writer:
            raise BlackBoardError(
                f"Message received events can only be watched on writing interface instances ({instance.uid})"
            )
        table.register(listener, instance, events)

    return listen
