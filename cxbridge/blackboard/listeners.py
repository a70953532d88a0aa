"""Listeners of interfaces and observers of a blackboard."""

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
    """Derive from it to be notified of interfaces that come into being and vanish."""

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        """Handle the opening of an interface's first instance."""

    def interface_destroyed(self, interface_type: str, interface_id: str) -> None:
        """Handle the closing of an interface's last instance; its data are gone."""


class _ObserverRegistration(Struct, eq=False):
    """An observer and the interfaces that it watches."""

    observer: Observer
    type_glob: str
    id_glob: str
    active: bool = True


class ObserverTable:
    """The observers of one blackboard; like :class:`ListenerTable`.

    :param report: called for observers that fail.
    """

    __slots__ = ("_lock", "_report", "_watches")

    def __init__(self, report: Report) -> None:
        self._report: Final = report
        self._lock = threading.Lock()
        self._watches: tuple[_ObserverRegistration, ...] = ()

    def register(self, observer: Observer, type_glob: str, id_glob: str) -> None:
        """Notify ``observer`` of interfaces that match both patterns."""
        with self._lock:
            self._watches = (*self._watches, _ObserverRegistration(observer, type_glob, id_glob))

    def unregister(self, observer: Observer) -> None:
        """Stop notifying ``observer``."""
        with self._lock:
            for watch in self._watches:
                watch.active &= watch.observer is not observer
            self._watches = tuple(watch for watch in self._watches if watch.active)

    def created(self, interface_type: str, interface_id: str) -> None:
        """Deliver that an interface came into being."""
        for watch in self._selected(interface_type, interface_id):
            self._deliver(watch, watch.observer.interface_created, interface_type, interface_id)

    def destroyed(self, interface_type: str, interface_id: str) -> None:
        """Deliver that an interface vanished."""
        for watch in self._selected(interface_type, interface_id):
            self._deliver(watch, watch.observer.interface_destroyed, interface_type, interface_id)

    def _selected(self, interface_type: str, interface_id: str) -> list[_ObserverRegistration]:
        """One watch an observer, however many of its patterns match."""
        found: dict[int, _ObserverRegistration] = {}
        for watch in self._watches:
            if matches(interface_type, interface_id, watch.type_glob, watch.id_glob):
                found.setdefault(id(watch.observer), watch)
        return list(found.values())

    def _deliver(self, watch: _ObserverRegistration, call: Callable[[str, str], None], *names: str) -> None:
        if watch.active:
            try:
                call(*names)
            except Exception as error:  # noqa: BLE001 - an observer's fault is not the caller's
                self._report(f"{call.__name__} of {'::'.join(names)}", error)


Report = Callable[[str, Exception], None]
"""Takes the operation in which a listener failed, and its error."""


class EventKind(StrEnum):
    """What can happen on an interface; the value is the name of the listener's method."""

    DATA_REFRESHED = "data_refreshed"
    DATA_CHANGED = "data_changed"
    MESSAGE_RECEIVED = "message_received"
    READER_ADDED = "reader_added"
    READER_REMOVED = "reader_removed"
    WRITER_ADDED = "writer_added"
    WRITER_REMOVED = "writer_removed"


class Listener:
    """Derive from it, override the events that you want, and register it for an instance of yours.

    The first argument is always the instance it was registered for; its private copy is what you last read.
    """

    def data_refreshed(self, interface: Interface) -> None:
        """Handle a write; called before :meth:`data_changed` of the same write."""

    def data_changed(self, interface: Interface) -> None:
        """Handle a write with changed data."""

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - for heirs
        """Judge a message that was sent; it is not in the queue yet.

        :returns: whether it goes to the next listener, and finally into the writer's queue.
        """
        return True

    def reader_added(self, interface: Interface, serial: UUID) -> None:
        """Handle the opening of an instance, of this serial, for reading."""

    def reader_removed(self, interface: Interface, serial: UUID) -> None:
        """Handle the closing of a reading instance."""

    def writer_added(self, interface: Interface, serial: UUID) -> None:
        """Handle the opening of an instance for writing."""

    def writer_removed(self, interface: Interface, serial: UUID) -> None:
        """Handle the closing of the writing instance; its data stay."""


class _Registration(Struct, eq=False):
    """A listener, for an instance, and its method for one kind of event."""

    listener: Listener
    instance: Interface
    call: Callable[..., bool | None]
    active: bool = True


def overridden_kinds(listener: Listener, *, messages: bool) -> tuple[EventKind, ...]:
    """Return the events whose method the listener's class, or the listener itself, overrides.

    :param messages: whether messages may be among them.
    """
    return tuple(
        kind
        for kind in EventKind
        if (messages or kind is not EventKind.MESSAGE_RECEIVED)
        and getattr(getattr(listener, kind), "__func__", None) is not getattr(Listener, kind)
    )


Audience = tuple[_Registration, ...]
"""Those to notify of an event."""

DataAudience = tuple[Audience, Audience]
"""Those to notify of a write, and those to notify of it when data changed."""


class ListenerTable:
    """The listeners of one interface.

    Tables of entries are replaced, never changed: a delivery goes through the one it began with.

    :param report: called for listeners that fail.
    """

    __slots__ = ("_entries", "_known", "_lock", "_report", "data_audience", "has_data")

    def __init__(self, report: Report) -> None:
        self._report: Final = report
        self._lock = threading.Lock()
        self._entries: dict[str, tuple[_Registration, ...]] = {}
        self._known: set[tuple[str, int, int]] = set()  # kind, listener and instance of each entry
        self.has_data = False
        """Whether anybody wants data events."""
        self.data_audience: DataAudience | None = None
        """The listeners of a write that happens now; None: no listener. Called at each write."""

    def register(self, listener: Listener, instance: Interface, kinds: tuple[EventKind, ...]) -> None:
        """Notify ``listener`` of events of these kinds on behalf of ``instance``; twice is once."""
        with self._lock:
            for kind in kinds:
                key = (kind, id(listener), id(instance))
                if key not in self._known:
                    self._known.add(key)
                    entry = _Registration(listener, instance, getattr(listener, kind))
                    self._entries[kind] = (*self._entries.get(kind, ()), entry)
            self._note_data()

    def unregister(self, listener: Listener | None, instance: Interface | None) -> bool:
        """Stop notifying ``listener`` for ``instance``; None stands for any. Return whether it was."""
        found = False
        with self._lock:
            for kind, entries in list(self._entries.items()):
                kept = []
                for entry in entries:
                    if listener in (None, entry.listener) and instance in (None, entry.instance):
                        entry.active = False
                        self._known.discard((kind, id(entry.listener), id(entry.instance)))
                        found = True
                    else:
                        kept.append(entry)
                self._entries[kind] = tuple(kept)
            self._note_data()
        return found

    def _note_data(self) -> None:
        refreshed = self._entries.get(EventKind.DATA_REFRESHED, ())
        altered = self._entries.get(EventKind.DATA_CHANGED, ())
        self.data_audience = (refreshed, altered) if refreshed or altered else None
        self.has_data = self.data_audience is not None

    def notify_data(self, audience: DataAudience, changed: bool) -> None:
        """Announce to those still registered that data were written, then, if so, that they changed."""
        refreshed, altered = audience
        if refreshed:
            self.notify_audience(refreshed, EventKind.DATA_REFRESHED)
        if changed and altered:
            self.notify_audience(altered, EventKind.DATA_CHANGED)

    def notify(self, kind: EventKind, *args: UUID) -> None:
        """Deliver an event to all listeners of its kind, in the order of registration."""
        self.notify_audience(self.audience(kind), kind, *args)

    def audience(self, kind: EventKind) -> Audience:
        """Return whom to notify of an event that happens now and is delivered later."""
        return self._entries.get(kind, ())

    def notify_audience(self, audience: Audience, kind: EventKind, *args: UUID) -> None:
        """Deliver an event to those of an audience who are still registered."""
        for entry in audience:
            if entry.active:
                try:
                    entry.call(entry.instance, *args)
                except Exception as error:  # noqa: BLE001 - a listener's fault is not the caller's
                    self._report(f"{kind} of {entry.instance.uid}", error)

    def accept(self, message: Message) -> bool:
        """Ask the message listeners, until one says no, whether ``message`` goes into the queue.

        One that fails has not said no.
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
"""Registers listeners of an instance, in the table of its interface."""


def listening(listener: Listener, *kinds: EventKind) -> Listen:
    """Return what registers a listener while an instance is being opened, so that it misses nothing.

    A listener that is registered afterwards misses earlier events: a message waits in the
    queue then, and openings and closings are never announced. While the instance is being opened, no variable
    holds it yet: a listener should use the instance that it is given.

    :param kinds: as :meth:`~cxbridge.blackboard.base.BlackBoard.register_listener` has them.
    """

    def listen(instance: Interface, table: ListenerTable) -> None:
        wanted = kinds or overridden_kinds(listener, messages=instance.is_writer)
        if EventKind.MESSAGE_RECEIVED in wanted and not instance.is_writer:
            raise BlackBoardError(
                f"Message received events can only be watched on writing interface instances ({instance.uid})"
            )
        table.register(listener, instance, wanted)

    return listen
