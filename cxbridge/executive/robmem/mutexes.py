"""Mutexes as documents: ``_id`` the name, ``locked``, and while it is locked ``locked-by`` and ``lock-time``.

Each operation is one atomic update, so it does not matter who else does one at the same time.
"""

from __future__ import annotations

import socket
from contextlib import suppress

from cxbridge.clock import Clock
from cxbridge.executive.robmem.errors import DuplicateKeyError
from cxbridge.executive.robmem.store import Store
from cxbridge.executive.robmem.values import from_ms

_OPEN = {"$set": {"locked": False}, "$unset": {"locked-by": True, "lock-time": True}}


class Mutexes:
    """The mutexes in a collection of a store.

    All methods raise :class:`RobotMemoryError` when the database cannot be reached.

    :param collection: e.g. ``robmem_coordination.mutex``.
    :param clock: how old locks are is judged by it.
    """

    def __init__(self, store: Store, collection: str, clock: Clock) -> None:
        self._store = store
        self._collection = collection
        self._clock = clock

    def create(self, name: str) -> bool:
        """Make a mutex that is open; whether there was none of that name."""
        try:
            self._store.insert(self._collection, {"_id": name, "locked": False})
        except DuplicateKeyError:
            return False
        return True

    def destroy(self, name: str) -> bool:
        """Remove a mutex, no matter who has it; True also when there is none, as in Fawkes."""
        self._store.remove(self._collection, {"_id": name})
        return True

    def try_lock(self, name: str, identity: str, *, force: bool = False) -> bool:
        """Lock a mutex, which is made if there is none; whether it is ours now.

        :param identity: who locks it; the name of this machine when it is empty.
        :param force: take it from its owner.
        """
        owner = identity or socket.gethostname()
        query: dict[str, object] = {"_id": name} if force else {"_id": name, "locked": False}
        changes = {"$set": {"locked": True, "locked-by": owner}, "$currentDate": {"lock-time": True}}
        try:
            found = self._store.find_one_and_update(self._collection, query, changes, upsert=True)
        except DuplicateKeyError:
            return False  # it has an owner
        return found is not None and found.get("locked-by") == owner

    def renew(self, name: str, identity: str) -> bool:
        """Make our lock as young as one made now; whether it was ours."""
        owner = identity or socket.gethostname()
        found = self._store.find_one_and_update(
            self._collection,
            {"_id": name, "locked": True, "locked-by": owner},
            # all fields, so that the receiver need not know the mutex
            {"$set": {"locked": True, "locked-by": owner}, "$currentDate": {"lock-time": True}},
        )
        return found is not None

    def unlock(self, name: str, identity: str) -> bool:
        """Open a mutex that is ours; whether it was. Fawkes says FALSE in any case."""
        owner = identity or socket.gethostname()
        query = {"_id": name, "locked-by": owner}
        with suppress(DuplicateKeyError):
            # one that is not there is made, open, as in Fawkes
            return self._store.find_one_and_update(self._collection, query, _OPEN, upsert=True) is not None
        return False

    def setup_ttl(self, max_age_s: float) -> bool:
        """Have mutexes removed when their locks are older, within a minute."""
        self._store.create_index(self._collection, {"lock-time": 1}, expire_after_s=max_age_s)
        return True

    def expire(self, max_age_s: float) -> bool:
        """Open all mutexes whose locks are as old or older."""
        limit = from_ms(self._clock.now_us() // 1000 - int(max_age_s * 1000))
        self._store.update(self._collection, {"locked": True, "lock-time": {"$lte": limit}}, _OPEN)
        return True
