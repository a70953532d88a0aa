"""Listeners of interfaces and observers of a blackboard, and the tables that notify them.

A listener handles the events of the interfaces for which it is registered, an observer the creation and
destruction of interfaces. A local blackboard calls both in the thread of the event, a remote blackboard
mostly in its dispatcher's thread. The blackboard holds no lock during the call, so that listeners and
observers may use the blackboard. A table replaces a tuple of registrations at each change, so that a
notification in progress iterates over the old tuple.
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
    """Base class of observers, which handle the creation and destruction of interfaces.

    An observer overrides `interface_created` and `interface_destroyed`, or only `existence_changed`.
    """

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        """Handle the opening of an interface's first instance."""
        self.existence_changed(interface_type, interface_id, created=True)

    def interface_destroyed(self, interface_type: str, interface_id: str) -> None:
        """Handle the closing of an interface's last instance, which discards the data."""
        self.existence_changed(interface_type, interface_id, created=False)

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:
        """Handle the creation or destruction of an interface."""


class _ObserverRegistration(Struct, eq=False):
    observer: Observer
    type_glob: str
    id_glob: str
    is_active: bool = True


FaultReporter = Callable[[str, Exception], None]
"""Called with the operation in which a listener or observer failed, and with the error."""


class ObserverTable:
    """The observers of a blackboard.

    :param report: called with the operation and error of a failed observer.
    """

    __slots__ = ("_lock", "_registrations", "_report")

    def __init__(self, report: FaultReporter) -> None:
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
                registration.is_active &= registration.observer is not observer
            self._registrations = tuple(
                registration for registration in self._registrations if registration.is_active
            )

    def notify(self, interface_type: str, interface_id: str, *, created: bool) -> None:
        """Notify the observers of a created or destroyed interface."""
        for registration in self._find_registrations(interface_type, interface_id):
            if registration.is_active:
                observer = registration.observer
                method = observer.interface_created if created else observer.interface_destroyed
                try:
                    method(interface_type, interface_id)
                except Exception as error:  # noqa: BLE001 - an observer's fault is not the caller's
                    self._report(f"{method.__name__} of {interface_type}::{interface_id}", error)

    def _find_registrations(self, interface_type: str, interface_id: str) -> list[_ObserverRegistration]:
        """Return one registration of each observer with a match: the first, if several match."""
        selected: dict[int, _ObserverRegistration] = {}
        for registration in self._registrations:
            if matches(interface_type, interface_id, registration.type_glob, registration.id_glob):
                selected.setdefault(id(registration.observer), registration)
        return list(selected.values())


class EventKind(StrEnum):
    """Kinds of events of an interface; the value is the name of the :class:`Listener`'s method."""

    DATA_REFRESHED = "data_refreshed"
    DATA_CHANGED = "data_changed"
    MESSAGE_RECEIVED = "message_received"
    READER_ADDED = "reader_added"
    READER_REMOVED = "reader_removed"
    WRITER_ADDED = "writer_added"
    WRITER_REMOVED = "writer_removed"


class Listener:
    """Base class of listeners, which override the methods of the events that they handle.

    The first argument is always the instance for which the listener was registered. The instance shows the
    data of its last ``read()``: a listener that needs the new data reads first. The argument ``serial`` is
    the serial of the opened or closed instance.
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
        """Handle the closing of the writing instance; the last data remain readable."""


class MembershipListener(Listener):
    """Base class of listeners that handle the openings and closings of instances in one method."""

    def membership_changed(self, interface: Interface, kind: EventKind, serial: UUID) -> None:
        """Handle the opening or closing of an instance.

        :param kind: one of `MEMBERSHIP_KINDS`.
        :param serial: the serial of the opened or closed instance.
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
    """Return the kind of event for an opened (``added``) or closed instance."""
    # MEMBERSHIP_KINDS lists the readers first, and the opening before the closing
    return MEMBERSHIP_KINDS[2 * writer + (not added)]


class _Registration(Struct, eq=False):
    listener: Listener
    instance: Interface
    method: Callable[..., bool | None]
    is_active: bool = True


def overridden_kinds(listener: Listener, *, messages: bool) -> tuple[EventKind, ...]:
    """Return the kinds of events whose method is overridden in the listener's class or instance.

    :param messages: whether to include messages.
    """
    # __func__ of a bound method is the function in the class; a plain function set on an instance has none
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

    :param report: called with the operation and error of a failed listener.
    """

    __slots__ = ("_lock", "_registrations", "_report", "data_audience")

    def __init__(self, report: FaultReporter) -> None:
        self._report: Final = report
        self._lock = threading.Lock()
        self._registrations: dict[str, tuple[_Registration, ...]] = {}  # by kind of event
        # computed at registration, because each write reads it
        self.data_audience: DataAudience | None = None
        """The registrations for writes; None without any."""

    def register(self, listener: Listener, instance: Interface, kinds: tuple[EventKind, ...]) -> None:
        """Register a listener of an instance; a repeated registration has no effect."""
        with self._lock:
            for kind in kinds:
                registrations = self._registrations.get(kind, ())
                if not any(
                    registration.listener is listener and registration.instance is instance
                    for registration in registrations
                ):
                    registration = _Registration(listener, instance, getattr(listener, kind))
                    self._registrations[kind] = (*registrations, registration)
            self._update_data_audience()

    def unregister(self, listener: Listener | None, instance: Interface) -> None:
        """Remove the registrations of a listener for an instance; None: of all listeners."""
        with self._lock:
            for kind, registrations in list(self._registrations.items()):
                remaining = []
                for registration in registrations:
                    if instance is registration.instance and listener in (None, registration.listener):
                        registration.is_active = False  # a notification in another thread may still hold it
                    else:
                        remaining.append(registration)
                self._registrations[kind] = tuple(remaining)
            self._update_data_audience()

    def _update_data_audience(self) -> None:
        refresh_audience = self._registrations.get(EventKind.DATA_REFRESHED, ())
        change_audience = self._registrations.get(EventKind.DATA_CHANGED, ())
        self.data_audience = (
            (refresh_audience, change_audience) if refresh_audience or change_audience else None
        )

    def notify_data(self, audience: DataAudience, changed: bool) -> None:
        """Notify the active listeners of a write."""
        refresh_audience, change_audience = audience
        if refresh_audience:
            self.notify_audience(refresh_audience, EventKind.DATA_REFRESHED)
        if changed and change_audience:
            self.notify_audience(change_audience, EventKind.DATA_CHANGED)

    def notify(self, kind: EventKind, *args: UUID) -> None:
        """Notify all listeners of an event, in the order of registration."""
        self.notify_audience(self.find_audience(kind), kind, *args)

    def find_audience(self, kind: EventKind) -> Audience:
        """Return the present registrations for a kind of event, for a later notification."""
        return self._registrations.get(kind, ())

    def notify_audience(self, audience: Audience, kind: EventKind, *args: UUID) -> None:
        """Notify the active listeners of ``audience``."""
        for registration in audience:
            if registration.is_active:
                try:
                    registration.method(registration.instance, *args)
                except Exception as error:  # noqa: BLE001 - a listener's fault is not the caller's
                    self._report(f"{kind} of {registration.instance.uid}", error)

    def ask_listeners(self, message: Message) -> bool:
        """Call the message listeners until a listener handles the message.

        :returns: whether to queue the message: no listener has returned False. The failure of a listener
            does not count as False.
        """
        for registration in self._registrations.get(EventKind.MESSAGE_RECEIVED, ()):
            if registration.is_active:
                try:
                    if registration.method(registration.instance, message) is False:
                        return False
                except Exception as error:  # noqa: BLE001 - a listener's fault is not the sender's
                    self._report(f"message_received of {registration.instance.uid}", error)
        return True


ListenerRegistrar = Callable[[Interface, ListenerTable], None]
"""Registers listeners of an instance in the table of its interface."""


def listening(listener: Listener, *kinds: EventKind) -> ListenerRegistrar:
    """Return a function that registers a listener while its instance is being opened.

    A listener that is registered after the opening misses the events in between. The listener must use the
    instance in its arguments, because its events may precede the return of ``open_for_reading``.

    :param kinds: as in :meth:`~cxbridge.blackboard.base.BlackBoard.register_listener`.
    """

    def listen(instance: Interface, table: ListenerTable) -> None:
        listened_kinds = kinds or overridden_kinds(listener, messages=instance.is_writer)
        if EventKind.MESSAGE_RECEIVED in listened_kinds and not instance.is_writer:
            raise BlackBoardError(
                f"Message received events can only be watched on writing interface instances ({instance.uid})"
            )
        table.register(listener, instance, listened_kinds)

    return listen
