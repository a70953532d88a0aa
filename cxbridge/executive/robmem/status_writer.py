"""The status of a replica set in its interface, which agents wait for before they use the robot memory."""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from cxbridge.executive.robmem.store import SetStatus
from cxbridge.interfaces.instance import Interface

if TYPE_CHECKING:
    from cxbridge.executive.robmem.store import Store

_PERIOD_S = 1.0
_MAX_TEXT = 1023  # characters of the interface's field without its NUL


class StatusWriter:
    """Polls the status of a replica set. The owner calls :meth:`write`.

    :param interface: a MongoDBManagedReplicaSetInterface for writing; its id is the set's name.
    """

    # a thread polls a database, which may take seconds to reply; a local store is polled once
    def __init__(self, interface: Interface, store: Store) -> None:
        self._interface = interface
        self._store = store
        self._status = SetStatus("UNKNOWN", "PRIMARY_UNKNOWN", "")
        self._written: SetStatus | None = None
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        if store.is_local:
            self._status = store.set_status(interface.id)
        else:
            self._thread = threading.Thread(target=self._poll_status, name="robot-memory-status", daemon=True)
            self._thread.start()
        self.write()

    def _poll_status(self) -> None:
        while not self._end.is_set():
            self._status = self._store.set_status(self._interface.id)
            self._end.wait(_PERIOD_S)

    def write(self) -> None:
        """Write the interface after changes."""
        status = self._status
        if status == self._written:
            return
        self._written = status
        self._set("member_status", status.member)
        self._set("primary_status", status.primary)
        self._interface.set("error_msg", status.error[:_MAX_TEXT])
        self._interface.write()

    def _set(self, name: str, item: str) -> None:
        (enum,) = (field.enum for field in self._interface.SCHEMA.fields if field.name == name)
        assert enum is not None
        self._interface.set(name, {entry.name: entry.value for entry in enum.items}[item])

    def close(self) -> None:
        """Stop polling and close the interface."""
        self._end.set()
        if self._thread is not None:
            self._thread.join()
        self._interface.close()
