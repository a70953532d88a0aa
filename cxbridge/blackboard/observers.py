"""Observers of interfaces that come into being and vanish; called as listeners are."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import Final

from msgspec import Struct

from cxbridge.blackboard.listeners import Report
from cxbridge.blackboard.names import matches


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
