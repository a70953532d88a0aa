"""The interface of document stores, implemented by :mod:`embedded`, :mod:`split` and :mod:`mongodb`.

Collections are named ``DATABASE.COLLECTION``, as in Fawkes. Stores copy their arguments and results, so that
callers may change them.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from msgspec import Struct

from cxbridge.closing import Closing
from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.values import Document

ChangeEvent = Document
"""An event of a change stream.

The fields are ``operationType`` (insert, update, replace, delete), ``ns``, ``documentKey``, ``fullDocument``
(except for delete), ``clusterTime``, ``wallTime``; MongoDB has further fields.
"""

ChangeCallback = Callable[[ChangeEvent], object]

MAX_NAME_LENGTH = 120
"""The maximum length of a collection's name, with the database: the limit of older versions of MongoDB."""


def split_name(collection: str) -> tuple[str, str]:
    """Split ``DATABASE.COLLECTION`` at the first dot.

    :raises QueryError: if the name is invalid.
    """
    database, dot, name = collection.partition(".")
    if (
        not dot
        or not database
        or not name
        or len(collection) > MAX_NAME_LENGTH
        or "\0" in collection
        or "$" in name
    ):
        raise QueryError(
            f"'{collection}' is not a collection", hint="name it DATABASE.COLLECTION, e.g. robmem.test"
        )
    return database, name


class ReplicaSetStatus(Struct, frozen=True):
    """The status of a replica set, with the names of the enum items in MongoDBManagedReplicaSetInterface.

    :param member: the role of the server in the replica set, or a state without a role, e.g. ``UNKNOWN``.
    :param primary: the item for whether the replica set has a server that accepts writes.
    :param error: the reason if the status is unknown, or there is no replica set; else empty.
    """

    member: str
    primary: str
    error: str


class Watch(ABC):
    """A subscription to changes of a collection."""

    @abstractmethod
    def close(self) -> None:
        """End the subscription. Further calls do nothing."""


class Store(Closing):
    """Documents in collections.

    Methods may be called from any thread. They raise :class:`QueryError` for an invalid document, query or
    update, and :class:`UnreachableError` if the database is unreachable.
    """

    is_local: bool
    """Whether the store is in this process.

    A local store replies immediately, and reports each change before the method that writes returns.
    """

    @abstractmethod
    def insert(self, collection: str, document: Mapping[str, Any]) -> Any:
        """Insert a document; return its ``_id``, generated if missing.

        :raises DuplicateKeyError: if the ``_id`` or a unique value exists.
        """

    @abstractmethod
    def update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> int:
        """Change all matching documents; return their number, 1 after an insertion.

        :param changes: operators (``{"$set": {...}}``), or plain fields to set.
        :param upsert: without a match, insert a document with the query's equalities and the changes.
        :raises DuplicateKeyError: as in :meth:`insert`.
        """

    @abstractmethod
    def find_one_and_update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> Document | None:
        """Change the first matching document atomically; return the changed document.

        :returns: None if no document matches and ``upsert`` is False.
        :raises DuplicateKeyError: as in :meth:`update`.
        """

    @abstractmethod
    def find(
        self,
        collection: str,
        query: Mapping[str, Any] | None = None,
        *,
        sort: Mapping[str, int] | None = None,
    ) -> list[Document]:
        """Return the matching documents; without a query, all documents.

        :param sort: paths with 1 (ascending) or -1; without it the order is unspecified.
        """

    @abstractmethod
    def remove(self, collection: str, query: Mapping[str, Any]) -> int:
        """Remove all matching documents; return their number."""

    @abstractmethod
    def watch(self, collection: str, query: Mapping[str, Any], on_change: ChangeCallback) -> Watch:
        """Report each change of a collection, in order.

        :param query: a query on events, e.g. ``{"operationType": "insert"}``; empty: all events.
        :param on_change: called with a copy of the event. The embedded store calls it in the writing thread
            before the write returns, the store on MongoDB in a separate thread. The callback must be quick,
            not change the store, and not raise.
        """

    @abstractmethod
    def create_index(
        self,
        collection: str,
        keys: Mapping[str, int],
        *,
        unique: bool = False,
        expire_after_s: float | None = None,
    ) -> None:
        """Create an index.

        :param unique: refuse documents with equal values.
        :param expire_after_s: the age in seconds at which documents are removed, by the time at the single
            path.
        :raises QueryError: in the embedded store for a unique or expiring index.
        """

    def replica_set_status(self, _name: str) -> ReplicaSetStatus:
        """Return the status of a replica set. May block. A local store always reports a primary."""
        return ReplicaSetStatus("PRIMARY", "HAVE_PRIMARY", "")
