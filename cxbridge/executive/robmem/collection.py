"""A collection of the embedded store, with its indexes."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from cxbridge.executive.robmem.errors import DuplicateKeyError, QueryError
from cxbridge.executive.robmem.query import compile_query, equalities, leaves, needs_mongodb, order_of
from cxbridge.executive.robmem.values import MISSING, Document, Key, key, to_ms

# A scan of this many documents is faster than an index.
_SCANNED = 32

# Limit of automatic indexes, because each index slows down writes.
_MOST_INDEXES = 16


@dataclass(frozen=True, slots=True)
class IndexSpec:
    """An index, see :meth:`.store.Store.create_index`.

    :param keys: paths with 1 or -1.
    :param unique: refuse documents with equal values.
    :param expire_after_s: remove documents whose time at the single path is older.
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
            raise QueryError("documents expire by one field, after 0 seconds at least")
        if expire_after_s is not None and "_id" in keys:
            raise QueryError("documents do not expire by their '_id'")
        return cls(tuple(order_of(keys, "index")), unique, expire_after_s)

    @property
    def paths(self) -> tuple[str, ...]:
        return tuple(path for path, _ in self.keys)


@dataclass
class _Unique:
    """The values of a unique index with their documents."""

    paths: tuple[str, ...]
    owners: dict[Hashable, Hashable] = field(default_factory=dict)

    def keys(self, document: Document) -> set[tuple[Key, ...]]:
        """Return a document's values in the index."""
        return {tuple(key(_single(document, path)) for path in self.paths)}


class Collection:
    """Documents in insertion order."""

    # agents repeat the same queries, so a query for equality indexes its path automatically
    def __init__(self) -> None:
        self._documents: dict[Hashable, Document] = {}
        self._indexes: dict[str, dict[Hashable, dict[Hashable, None]]] = {}
        self._unique: dict[tuple[str, ...], _Unique] = {}
        self._specs: dict[tuple[tuple[str, int], ...], IndexSpec] = {}

    def __len__(self) -> int:
        return len(self._documents)

    def all(self) -> Iterable[Document]:
        """Return the stored documents, not copies."""
        return self._documents.values()

    def get(self, identity: Any) -> Document | None:
        """Return the document with an ``_id``, or None."""
        return self._documents.get(key(identity))

    def find(self, query: Mapping[str, Any]) -> Iterator[Document]:
        """Yield the matching stored documents. The collection must not change during the iteration.

        :raises QueryError: if the query is invalid.
        """
        fits = compile_query(query)
        return (document for document in self._candidates(query) if fits(document))

    def _candidates(self, query: Mapping[str, Any]) -> Iterable[Document]:
        """Return a superset of the matching documents, in insertion order."""
        if not query:
            return self._documents.values()
        wanted = list(equalities(query))
        for path, value in wanted:
            if path == "_id":
                document = self._documents.get(key(value))
                return () if document is None else (document,)
        if len(self._documents) <= _SCANNED:
            return self._documents.values()
        best: dict[Hashable, None] | None = None
        for path, value in wanted:
            index = self._index(path)
            if index is not None:
                found = index.get(key(value), {})
                if best is None or len(found) < len(best):
                    best = found
        if best is None:
            return self._documents.values()
        return (self._documents[identity] for identity in best)

    def _index(self, path: str) -> dict[Hashable, dict[Hashable, None]] | None:
        """Return the index of a path, made if necessary; None if there are too many indexes."""
        index = self._indexes.get(path)
        if index is None and len(self._indexes) < _MOST_INDEXES:
            index = self._indexes[path] = {}
            for identity, document in self._documents.items():
                for each in _leaf_keys(document, path):
                    index.setdefault(each, {})[identity] = None
        return index

    def check(self, document: Document, replaced: Document | None = None) -> None:
        """Raise :class:`DuplicateKeyError` if another document has the same unique values."""
        identity = key(document["_id"])
        if replaced is None and identity in self._documents:
            raise DuplicateKeyError(f"there is a document with the _id {document['_id']!r} already")
        for unique in self._unique.values():
            for each in unique.keys(document):
                if unique.owners.get(each, identity) != identity:
                    raise DuplicateKeyError(f"another document has the same {', '.join(unique.paths)}")

    def put(self, document: Document, replaced: Document | None = None) -> None:
        """Add or replace a document after :meth:`check`."""
        identity = key(document["_id"])
        for path, index in self._indexes.items():
            now = _leaf_keys(document, path)
            if replaced is not None:
                before = _leaf_keys(replaced, path)
                if before == now:
                    continue
                _forget(index, before - now, identity)
                now -= before
            for each in now:
                index.setdefault(each, {})[identity] = None
        for unique in self._unique.values():
            if replaced is not None:
                for each in unique.keys(replaced):
                    unique.owners.pop(each, None)
            unique.owners.update(dict.fromkeys(unique.keys(document), identity))
        self._documents[identity] = document

    def delete(self, document: Document) -> None:
        identity = key(document["_id"])
        for path, index in self._indexes.items():
            _forget(index, _leaf_keys(document, path), identity)
        for unique in self._unique.values():
            for each in unique.keys(document):
                unique.owners.pop(each, None)
        del self._documents[identity]

    def add_index(self, spec: IndexSpec) -> bool:
        """Add an index; return whether it is new.

        :raises DuplicateKeyError: if documents violate a unique index.
        :raises QueryError: if the keys have another index.
        """
        if self._check_index(spec):
            return False
        if spec.unique:
            unique = _Unique(spec.paths)
            for identity, document in self._documents.items():
                for each in unique.keys(document):
                    if unique.owners.setdefault(each, identity) != identity:
                        raise DuplicateKeyError(f"documents have the same {', '.join(spec.paths)} already")
            self._unique[spec.paths] = unique
        self._specs[spec.keys] = spec
        return True

    def _check_index(self, spec: IndexSpec) -> bool:
        """Return whether the index exists."""
        known = self._specs.get(spec.keys)
        if known not in (None, spec):
            raise QueryError(f"there is an index on {', '.join(spec.paths)} already, with other options")
        return known is not None

    def expired(self, now_ms: int) -> list[Document]:
        """Return the expired documents. In an array of times, the first counts."""
        found: dict[Hashable, Document] = {}
        for spec in self._specs.values():
            if spec.expire_after_s is None:
                continue
            (times,) = map(leaves, spec.paths)
            limit_ms = now_ms - spec.expire_after_s * 1000
            found |= {
                identity: document
                for identity, document in self._documents.items()
                if any(isinstance(time, datetime) and to_ms(time) < limit_ms for time in times(document))
            }
        return list(found.values())


def _single(document: Document, path: str) -> Any:
    """Return the value at a path."""
    value: Any = document
    for part in path.split("."):
        value = value.get(part, MISSING) if isinstance(value, dict) else MISSING
        if isinstance(value, list):
            raise needs_mongodb(f"a unique index on '{path}', an array,")
    return value


def _leaf_keys(document: Document, path: str) -> set[Hashable]:
    """Return the keys of all values that a query compares at a path."""
    return set(map(key, leaves(path)(document)))


def _forget(index: dict[Hashable, dict[Hashable, None]], keys: set[Hashable], identity: Hashable) -> None:
    for each in keys:
        known = index[each]
        known.pop(identity, None)
        if not known:
            del index[each]
