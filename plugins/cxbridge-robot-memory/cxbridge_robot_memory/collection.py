"""A collection of the embedded store, with its indexes."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from cxbridge_robot_memory.errors import DuplicateKeyError, QueryError
from cxbridge_robot_memory.query import compile_query, equalities, leaf_reader, parse_order, sort_key
from cxbridge_robot_memory.values import Document, Key, order_key, to_ms

# The maximum number of documents that a query scans: for few documents, a scan is faster than an index.
_MAX_SCANNED = 32

# The maximum number of automatic indexes, because each index slows down writes.
_MAX_INDEXES = 16


@dataclass(frozen=True, slots=True)
class IndexSpec:
    """An index, see :meth:`.store.Store.create_index`.

    :param keys: paths with 1 (ascending) or -1.
    :param unique: whether documents with equal values are refused.
    :param expire_after_s: the age in seconds at which documents are removed, by the time at the single path.
    """

    keys: tuple[tuple[str, int], ...]
    unique: bool = False
    expire_after_s: float | None = None

    @classmethod
    def read(
        cls, keys: Mapping[str, Any], *, unique: bool = False, expire_after_s: float | None = None
    ) -> IndexSpec:
        """Read the arguments of ``create_index``.

        :raises QueryError: if the arguments are invalid or unsupported.
        """
        if expire_after_s is not None and (len(keys) != 1 or not 0 <= expire_after_s < 2**31):
            raise QueryError("an expiring index must have a single field and an age of at least 0 seconds")
        if expire_after_s is not None and "_id" in keys:
            raise QueryError("an index on '_id' cannot expire documents")
        return cls(tuple(parse_order(keys, "index")), unique, expire_after_s)

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(path for path, _ in self.keys)


@dataclass
class _UniqueIndex:
    """A unique index.

    :param owners: the identity (key of ``_id``) of the document with the values of each key.
    """

    paths: tuple[str, ...]
    owners: dict[Hashable, Hashable] = field(default_factory=dict)

    def value_keys(self, document: Document) -> tuple[Key, ...]:
        """Return the keys of a document's values in the index."""
        return tuple(sort_key(document, path, "a unique index on") for path in self.paths)


class Collection:
    """The documents of a collection, in insertion order."""

    # agents repeat the same queries, so a query for equality indexes its path automatically; an index maps
    # the key of a value to the identities (keys of ``_id``) of its documents, in a dictionary because sets
    # have no order
    def __init__(self) -> None:
        self._documents: dict[Hashable, Document] = {}
        self._indexes: dict[str, dict[Hashable, dict[Hashable, None]]] = {}
        self._unique: dict[tuple[str, ...], _UniqueIndex] = {}
        self._specs: dict[tuple[tuple[str, int], ...], IndexSpec] = {}

    def __len__(self) -> int:
        return len(self._documents)

    def find(self, query: Mapping[str, Any]) -> Iterator[Document]:
        """Yield the matching stored documents. The collection must not change during the iteration.

        :raises QueryError: if the query is invalid.
        """
        matches = compile_query(query)
        return (document for document in self._candidates(query) if matches(document))

    def _candidates(self, query: Mapping[str, Any]) -> Iterable[Document]:
        """Return a superset of the matching documents, in insertion order."""
        if not query:
            return self._documents.values()
        required = list(equalities(query))
        for path, value in required:
            if path == "_id":
                document = self._documents.get(order_key(value))
                return () if document is None else (document,)
        if len(self._documents) <= _MAX_SCANNED:
            return self._documents.values()
        indexed = [
            index.get(order_key(value), {})
            for path, value in required
            if (index := self._index(path)) is not None
        ]
        if not indexed:
            return self._documents.values()
        return (self._documents[identity] for identity in min(indexed, key=len))

    def _index(self, path: str) -> dict[Hashable, dict[Hashable, None]] | None:
        """Return the index of a path, made if necessary; None if there are too many indexes."""
        index = self._indexes.get(path)
        if index is None and len(self._indexes) < _MAX_INDEXES:
            index = self._indexes[path] = {}
            for identity, document in self._documents.items():
                for key in _leaf_keys(document, path):
                    index.setdefault(key, {})[identity] = None
        return index

    def check_unique(self, document: Document, replaced: Document | None = None) -> None:
        """Check that no other document has the same ``_id`` or the same values in a unique index.

        :param replaced: the stored document that the document replaces; None for a new document.
        :raises DuplicateKeyError: if another document has the same ``_id`` or values.
        """
        identity = order_key(document["_id"])
        if replaced is None and identity in self._documents:
            raise DuplicateKeyError(f"a document with the _id {document['_id']!r} already exists")
        for unique in self._unique.values():
            if unique.owners.get(unique.value_keys(document), identity) != identity:
                raise DuplicateKeyError(f"another document has the same {', '.join(unique.paths)}")

    def store_document(self, document: Document, replaced: Document | None = None) -> None:
        """Add or replace a document after :meth:`check_unique`."""
        identity = order_key(document["_id"])
        for path, index in self._indexes.items():
            old_keys = set() if replaced is None else _leaf_keys(replaced, path)
            new_keys = _leaf_keys(document, path)
            _remove_from_index(index, old_keys - new_keys, identity)
            for key in new_keys - old_keys:
                index.setdefault(key, {})[identity] = None
        for unique in self._unique.values():
            if replaced is not None:
                unique.owners.pop(unique.value_keys(replaced), None)
            unique.owners[unique.value_keys(document)] = identity
        self._documents[identity] = document

    def delete(self, document: Document) -> None:
        """Remove a stored document."""
        identity = order_key(document["_id"])
        for path, index in self._indexes.items():
            _remove_from_index(index, _leaf_keys(document, path), identity)
        for unique in self._unique.values():
            unique.owners.pop(unique.value_keys(document), None)
        del self._documents[identity]

    def add_index(self, spec: IndexSpec) -> bool:
        """Add an index; return whether it is new.

        :raises DuplicateKeyError: if documents violate a unique index.
        :raises QueryError: if the keys have another index.
        """
        existing = self._specs.get(spec.keys)
        if existing not in (None, spec):
            raise QueryError(f"an index on {', '.join(spec.paths)} already exists with other options")
        if existing is not None:
            return False
        if spec.unique:
            unique = _UniqueIndex(spec.paths)
            for identity, document in self._documents.items():
                if unique.owners.setdefault(unique.value_keys(document), identity) != identity:
                    raise DuplicateKeyError(f"existing documents have the same {', '.join(spec.paths)}")
            self._unique[spec.paths] = unique
        self._specs[spec.keys] = spec
        return True

    def expired_documents(self, now_ms: int) -> list[Document]:
        """Return the expired documents. In an array of times, the earliest time counts."""
        limits_ms = [
            (leaf_reader(spec.paths[0]), now_ms - spec.expire_after_s * 1000)
            for spec in self._specs.values()
            if spec.expire_after_s is not None
        ]
        return [
            document
            for document in self._documents.values()
            if any(
                isinstance(time, datetime) and to_ms(time) < limit_ms
                for times, limit_ms in limits_ms
                for time in times(document)
            )
        ]


def _leaf_keys(document: Document, path: str) -> set[Hashable]:
    """Return the keys of all values that a query compares at a path."""
    return set(map(order_key, leaf_reader(path)(document)))


def _remove_from_index(
    index: dict[Hashable, dict[Hashable, None]], keys: set[Hashable], identity: Hashable
) -> None:
    """Remove a document from an index, and the keys of values that no document has any more.

    :param keys: the keys of the values that the document no longer has.
    """
    for key in keys:
        identities = index[key]
        identities.pop(identity, None)
        if not identities:
            del index[key]
