"""A store in two parts: databases of one agent, and databases that all agents of the process share.

Fawkes' robots have a local MongoDB replica set and a distributed replica set. The agents of a team in one
process have this store instead.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from cxbridge_robot_memory.store import ChangeCallback, Store, Watch, split_name
from cxbridge_robot_memory.values import Document


class SplitStore(Store):
    """Passes each call to the store of the collection's database.

    :param own_store: the agent's store, which is closed with the split store.
    :param shared_store: the store of all agents, which stays open.
    :param shared_databases: the names of the databases in the shared store.
    """

    is_local = True

    def __init__(self, own_store: Store, shared_store: Store, shared_databases: Sequence[str]) -> None:
        self._own_store = own_store
        self._shared_store = shared_store
        self._shared_databases = frozenset(shared_databases)

    def _find_store(self, collection: str) -> Store:
        database, _ = split_name(collection)
        return self._shared_store if database in self._shared_databases else self._own_store

    def insert(self, collection: str, document: Mapping[str, Any]) -> Any:
        return self._find_store(collection).insert(collection, document)

    def update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> int:
        return self._find_store(collection).update(collection, query, changes, upsert=upsert)

    def find_one_and_update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> Document | None:
        return self._find_store(collection).find_one_and_update(collection, query, changes, upsert=upsert)

    def find(
        self,
        collection: str,
        query: Mapping[str, Any] | None = None,
        *,
        sort: Mapping[str, int] | None = None,
    ) -> list[Document]:
        return self._find_store(collection).find(collection, query, sort=sort)

    def remove(self, collection: str, query: Mapping[str, Any]) -> int:
        return self._find_store(collection).remove(collection, query)

    def watch(self, collection: str, query: Mapping[str, Any], on_change: ChangeCallback) -> Watch:
        return self._find_store(collection).watch(collection, query, on_change)

    def create_index(
        self,
        collection: str,
        keys: Mapping[str, int],
        *,
        unique: bool = False,
        expire_after_s: float | None = None,
    ) -> None:
        self._find_store(collection).create_index(
            collection, keys, unique=unique, expire_after_s=expire_after_s
        )

    def close(self) -> None:
        """Close the agent's store."""
        self._own_store.close()
