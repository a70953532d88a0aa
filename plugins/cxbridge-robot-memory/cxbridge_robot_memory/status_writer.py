"""Writes the status of a MongoDB replica set to an interface.

Some agents wait for a primary server at their start.

A replica set is a group of MongoDB servers with the same documents, which report changes.
"""

from __future__ import annotations

import threading
from typing import TYPE_CHECKING

from cxbridge.interfaces.instance import Interface
from cxbridge_robot_memory.store import ReplicaSetStatus

if TYPE_CHECKING:
    from cxbridge_robot_memory.store import Store

_PERIOD_S = 1.0  # seconds between two polls


class StatusWriter:
    """Writes the status of a replica set. The owner calls :meth:`write` once in each loop.

    :param interface: a MongoDBManagedReplicaSetInterface for writing; its id is the set's name.
    """

    # a thread polls a server, which may take seconds to reply; the status of a local store never changes
    def __init__(self, interface: Interface, store: Store) -> None:
        self._interface = interface
        self._store = store
        self._status = ReplicaSetStatus("UNKNOWN", "PRIMARY_UNKNOWN", "")
        self._written_status: ReplicaSetStatus | None = None
        self._end = threading.Event()
        self._thread: threading.Thread | None = None
        if store.is_local:
            self._status = store.replica_set_status(interface.id)
        else:
            self._thread = threading.Thread(target=self._poll_status, name="robot-memory-status", daemon=True)
            self._thread.start()
        self.write()

    def _poll_status(self) -> None:
        while not self._end.is_set():
            self._status = self._store.replica_set_status(self._interface.id)
            self._end.wait(_PERIOD_S)

    def write(self) -> None:
        """Write the interface if the status has changed."""
        status = self._status
        if status == self._written_status:
            return
        self._written_status = status
        self._interface.set("member_status", status.member)
        self._interface.set("primary_status", status.primary)
        self._interface.set("error_msg", status.error)  # cut to the size of the field
        self._interface.write()

    def close(self) -> None:
        """Stop polling and close the interface."""
        self._end.set()
        if self._thread is not None:
            self._thread.join()
        self._interface.close()
