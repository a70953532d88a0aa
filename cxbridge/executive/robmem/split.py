"""A store in two parts: databases of one agent, and databases that all agents of the process share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cxbridge.executive.robmem.store import OnChange, Store, Watch, split_name
from cxbridge.executive.robmem.values import Document


class SplitStore(Store):
    """Hands each call to the store that has the database.

    :param own: closed with this one.
    :param common: the store that agents share; it is not closed here.
    :param shared: the databases in the common store.
    """

    is_local = True

    def __init__(self, own: Store, common: Store, shared: Sequence[str]) -> None:
        self._own = own
        self._common = common
        self._shared = frozenset(shared)

    def _of(self, collection: str) -> Store:
        return self._common if split_name(collection)[0] in self._shared else self._own

    def insert(self, collection: str, document: Mapping[str, Any]) -> Any:
        """Insert a document."""
        return self._of(collection).insert(collection, document)

    def update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> int:
        """Change all documents that fit."""
        return self._of(collection).update(collection, query, changes, upsert=upsert)

    def find_one_and_update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> Document | None:
        """Change the first document that fits."""
        return self._of(collection).find_one_and_update(collection, query, changes, upsert=upsert)

    def find(
        self,
        collection: str,
        query: Mapping[str, Any] | None = None,
        *,
        sort: Mapping[str, int] | None = None,
        limit: int = 0,
    ) -> list[Document]:
        """Return the documents that fit."""
        return self._of(collection).find(collection, query, sort=sort, limit=limit)

    def remove(self, collection: str, query: Mapping[str, Any]) -> int:
        """Remove all documents that fit."""
        return self._of(collection).remove(collection, query)

    def watch(self, collection: str, query: Mapping[str, Any], on_change: OnChange) -> Watch:
        """Report each change of a collection from now on."""
        return self._of(collection).watch(collection, query, on_change)

    def create_index(
        self,
        collection: str,
        keys: Mapping[str, int],
        *,
        unique: bool = False,
        expire_after_s: float | None = None,
    ) -> None:
        """Create an index."""
        self._of(collection).create_index(collection, keys, unique=unique, expire_after_s=expire_after_s)

    def drop(self, collection: str) -> None:
        """Remove a collection."""
        self._of(collection).drop(collection)

    def collections(self) -> list[str]:
        """Return the names of the collections that have documents."""
        return sorted({*self._own.collections(), *self._common.collections()})

    def attend(self) -> None:
        """Expire documents in both stores."""
        self._own.attend()
        self._common.attend()

    def close(self) -> None:
        """Close the agent's own store."""
        self._own.close()
