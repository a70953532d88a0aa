"""Mutexes as documents with the fields ``_id`` (the name), ``locked``, ``locked-by`` and ``lock-time``.

Each operation on a mutex is a single atomic change, which makes concurrent operations safe.
"""

from __future__ import annotations

import socket
from contextlib import suppress

from cxbridge.clock import Clock
from cxbridge_robot_memory.errors import DuplicateKeyError
from cxbridge_robot_memory.store import Store
from cxbridge_robot_memory.values import from_ms

_OPENING_UPDATE = {"$set": {"locked": False}, "$unset": {"locked-by": True, "lock-time": True}}


class Mutexes:
    """The mutexes in a collection of a store.

    Methods raise :class:`RobotMemoryError` if the database is unreachable. Where a method has a parameter
    ``identity``, an empty identity stands for this machine's name.

    :param collection: e.g. ``robmem_coordination.mutex``.
    :param clock: the time for the age of locks.
    """

    def __init__(self, store: Store, collection: str, clock: Clock) -> None:
        self._store = store
        self._collection = collection
        self._clock = clock

    def create(self, name: str) -> bool:
        """Create an open mutex; return False if the mutex exists."""
        try:
            self._store.insert(self._collection, {"_id": name, "locked": False})
        except DuplicateKeyError:
            return False
        return True

    def destroy(self, name: str) -> bool:
        """Remove a mutex regardless of its owner; return True even without such a mutex, as in Fawkes."""
        self._store.remove(self._collection, {"_id": name})
        return True

    def try_lock(self, name: str, identity: str, *, force: bool = False) -> bool:
        """Lock a mutex, and create it if necessary.

        :param identity: the new owner.
        :param force: take the mutex from its owner.
        :returns: whether this call locked the mutex; without ``force`` False if it is locked already, even by
            ``identity``.
        """
        owner = identity or socket.gethostname()
        query: dict[str, object] = {"_id": name} if force else {"_id": name, "locked": False}
        changes = {"$set": {"locked": True, "locked-by": owner}, "$currentDate": {"lock-time": True}}
        try:
            mutex = self._store.find_one_and_update(self._collection, query, changes, upsert=True)
        except DuplicateKeyError:
            # the query does not match a locked mutex, so the upsert would insert a document with the same _id
            return False
        return mutex is not None and mutex.get("locked-by") == owner

    def renew(self, name: str, identity: str) -> bool:
        """Renew the time of a lock; return whether ``identity`` owns the mutex."""
        owner = identity or socket.gethostname()
        mutex = self._store.find_one_and_update(
            self._collection,
            {"_id": name, "locked": True, "locked-by": owner},
            # as in Fawkes, unchanged fields are also set, so that triggers can process the event easily
            {"$set": {"locked": True, "locked-by": owner}, "$currentDate": {"lock-time": True}},
        )
        return mutex is not None

    def unlock(self, name: str, identity: str) -> bool:
        """Unlock a mutex, or create an open mutex if it is missing.

        :returns: False if the mutex exists and ``identity`` is not its owner. Fawkes always returns FALSE.
        """
        owner = identity or socket.gethostname()
        query = {"_id": name, "locked-by": owner}
        with suppress(DuplicateKeyError):
            # as in Fawkes, the upsert creates a missing mutex, which is open
            return (
                self._store.find_one_and_update(self._collection, query, _OPENING_UPDATE, upsert=True)
                is not None
            )
        return False

    def setup_ttl(self, max_age_s: float) -> bool:
        """Let the database remove each mutex whose lock is older than this age, within a minute; return True.

        :raises QueryError: in the embedded store, which cannot remove documents by age.
        """
        self._store.create_index(self._collection, {"lock-time": 1}, expire_after_s=max_age_s)
        return True

    def expire(self, max_age_s: float) -> bool:
        """Open each mutex whose lock has this age or is older; return True."""
        limit = from_ms(self._clock.now_us() // 1000 - int(max_age_s * 1000))
        self._store.update(self._collection, {"locked": True, "lock-time": {"$lte": limit}}, _OPENING_UPDATE)
        return True
