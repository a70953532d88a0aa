"""The interface of stores of documents; `embedded` and `mongodb` implement it.

Collections are named as in Fawkes: ``DATABASE.COLLECTION``. Documents go in and come out as copies.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

from msgspec import Struct

from cxbridge.executive.robmem.errors import QueryError
from cxbridge.executive.robmem.values import Document

Change = Document
"""An event of a change stream: ``operationType`` (insert, update, replace, delete), ``ns``, ``documentKey``,
``fullDocument`` (not of delete), ``updateDescription`` (of update), ``clusterTime``, ``wallTime``."""

OnChange = Callable[[Change], object]

MAX_NAME = 120
"""Characters in a collection's name, database included."""


def split_name(collection: str) -> tuple[str, str]:
    """Split ``DATABASE.COLLECTION``; the first dot parts them.

    :raises QueryError: when it is not such a name.
    """
    database, dot, name = collection.partition(".")
    if not dot or not database or not name or len(collection) > MAX_NAME or "\0" in collection or "$" in name:
        raise QueryError(
            f"'{collection}' is not a collection", hint="name it DATABASE.COLLECTION, e.g. robmem.test"
        )
    return database, name


class SetStatus(Struct, frozen=True):
    """How a replica set stands, in the words of MongoDBManagedReplicaSetInterface.

    :param member: the role of the server in use.
    :param primary: whether there is one that can be written to.
    :param error: the problem, in words; empty: none.
    """

    member: str
    primary: str
    error: str


class Watch(ABC):
    """Changes of a collection are reported until this is closed."""

    @abstractmethod
    def close(self) -> None:
        """Stop reporting. A second call does nothing."""


class Store(ABC):
    """Documents in collections.

    All methods may be called from any thread. All of them raise :class:`QueryError` for a document, query,
    or update that is not one, and :class:`AwayError` when the database cannot be reached.
    """

    is_local: bool
    """Whether it is in this process: it answers at once, and reports changes before a write returns."""

    @abstractmethod
    def insert(self, collection: str, document: Mapping[str, Any]) -> Any:
        """Insert a document; returns its ``_id``, which is made when it has none.

        :raises DuplicateKeyError: when there is one with this ``_id``, or this value of a unique index.
        """

    @abstractmethod
    def update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> int:
        """Change all documents that fit; returns how many fit, 1 for one that was inserted.

        :param changes: operators (``{"$set": {...}}``), or plain fields, which are set.
        :param upsert: insert a document when none fits: the query's equalities, then the changes.
        :raises DuplicateKeyError: as in :meth:`insert`.
        """

    @abstractmethod
    def find_one_and_update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> Document | None:
        """Change the first document that fits, atomically; returns the new document, None when none fits.

        :raises DuplicateKeyError: as in :meth:`update`.
        """

    @abstractmethod
    def find(
        self,
        collection: str,
        query: Mapping[str, Any] | None = None,
        *,
        sort: Mapping[str, int] | None = None,
        limit: int = 0,
    ) -> list[Document]:
        """Return the documents that fit; all without a query.

        :param sort: paths with 1 (ascending) or -1; without it in no order to rely on.
        :param limit: how many at most; 0 for all.
        """

    @abstractmethod
    def remove(self, collection: str, query: Mapping[str, Any]) -> int:
        """Remove all documents that fit; returns how many."""

    @abstractmethod
    def watch(self, collection: str, query: Mapping[str, Any], on_change: OnChange) -> Watch:
        """Report each change of a collection from now on, in the order of the changes.

        :param query: what events have to fit; empty for all. E.g. ``{"operationType": "insert"}``.
        :param on_change: called with a copy of the event: by the embedded store in the thread that changes
            something, before its call returns; by MongoDB's in another thread. It must be quick, must
            not change the store and not raise.
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

        :param unique: refuse documents that have the same values there.
        :param expire_after_s: remove documents when the time in that one field is older, within a minute.
        :raises DuplicateKeyError: when it is unique, and documents have the same values.
        """

    @abstractmethod
    def drop(self, collection: str) -> None:
        """Remove a collection with its documents and indexes. Not reported as changes of documents."""

    @abstractmethod
    def collections(self) -> list[str]:
        """Return the names of the collections that have documents, sorted."""

    def set_status(self, _name: str) -> SetStatus:
        """Return how a replica set stands; may take its time. A store in this process is always there."""
        return SetStatus("PRIMARY", "HAVE_PRIMARY", "")

    def attend(self) -> None:  # noqa: B027  a database does this by itself
        """Expire documents: called once a loop."""

    @abstractmethod
    def close(self) -> None:
        """Let go of everything. A second call does nothing."""
