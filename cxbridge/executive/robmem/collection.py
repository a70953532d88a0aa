"""The documents of one collection of the embedded store, and its indexes."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any

from cxbridge.executive.robmem.errors import DuplicateKeyError
from cxbridge.executive.robmem.query import compile_query, equalities
from cxbridge.executive.robmem.values import Document, index_keys, key, to_ms, values_at

_SCANNED = 32
"""So few documents are faster looked through than looked up."""

_MOST_INDEXES = 16
"""Indexes that queries made by themselves; each costs a little at every write."""


@dataclass
class _Unique:
    """A unique index: which document has which values."""

    paths: tuple[str, ...]
    owners: dict[Hashable, Hashable] = field(default_factory=dict)

    def keys(self, document: Document) -> set[Hashable]:
        """Return what the index knows a document by: all combinations of the paths' values."""
        combinations: set[tuple[Hashable, ...]] = {()}
        for path in self.paths:
            combinations = {(*begin, last) for begin in combinations for last in index_keys(document, path)}
        return set(combinations)


class Collection:
    """Documents in the order of their insertion.

    Queries that want a path equal make an index on it when the collection has more than a few documents:
    what agents ask for is the same again and again.
    """

    def __init__(self) -> None:
        self._documents: dict[Hashable, Document] = {}
        self._indexes: dict[str, dict[Hashable, dict[Hashable, None]]] = {}
        self._unique: dict[tuple[str, ...], _Unique] = {}
        self.expiring: dict[str, float] = {}
        """Paths of times, and how many seconds after them the documents go."""

    def __len__(self) -> int:
        return len(self._documents)

    def all(self) -> Iterable[Document]:
        """Return the documents themselves, not copies."""
        return self._documents.values()

    def get(self, identity: Any) -> Document | None:
        """Return the document with this `_id`."""
        return self._documents.get(key(identity))

    def find(self, query: Mapping[str, Any]) -> Iterator[Document]:
        """Yield the documents themselves that fit; the collection must not change meanwhile.

        :raises QueryError: when the query is not one.
        """
        fits = compile_query(query)
        return (document for document in self._candidates(query) if fits(document))

    def _candidates(self, query: Mapping[str, Any]) -> Iterable[Document]:
        """Return the documents that can fit at all, in the order of their insertion."""
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
        """Return the index on a path, made when there is none; None when there are too many."""
        index = self._indexes.get(path)
        if index is None and len(self._indexes) < _MOST_INDEXES:
            index = self._indexes[path] = {}
            for identity, document in self._documents.items():
                for each in index_keys(document, path):
                    index.setdefault(each, {})[identity] = None
        return index

    # --- changes ------------------------------------------------------------------------------------------

    def check(self, document: Document, replaced: Document | None = None) -> None:
        """Raise :class:`DuplicateKeyError` when the document cannot be put beside the others."""
        identity = key(document["_id"])
        if replaced is None and identity in self._documents:
            raise DuplicateKeyError(f"there is a document with the _id {document['_id']!r} already")
        for unique in self._unique.values():
            for each in unique.keys(document):
                if unique.owners.get(each, identity) != identity:
                    raise DuplicateKeyError(f"another document has the same {', '.join(unique.paths)}")

    def put(self, document: Document, replaced: Document | None = None) -> None:
        """Add a document, or put it where another with its `_id` was. It must have been checked."""
        identity = key(document["_id"])
        for path, index in self._indexes.items():
            now = index_keys(document, path)
            if replaced is not None:
                before = index_keys(replaced, path)
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
        """Take a document away."""
        identity = key(document["_id"])
        for path, index in self._indexes.items():
            _forget(index, index_keys(document, path), identity)
        for unique in self._unique.values():
            for each in unique.keys(document):
                unique.owners.pop(each, None)
        del self._documents[identity]

    def make_unique(self, paths: tuple[str, ...]) -> None:
        """Refuse documents with the same values from now on.

        :raises DuplicateKeyError: when there are such now.
        """
        if paths in self._unique:
            return
        unique = _Unique(paths)
        for identity, document in self._documents.items():
            for each in unique.keys(document):
                if unique.owners.setdefault(each, identity) != identity:
                    raise DuplicateKeyError(f"documents have the same {', '.join(paths)} already")
        self._unique[paths] = unique

    def expired(self, now_ms: int) -> list[Document]:
        """Return the documents whose time is over."""
        return [
            document
            for path, seconds in self.expiring.items()
            for document in self._documents.values()
            if any(_is_before(value, now_ms - seconds * 1000) for value in values_at(document, path))
        ]


def _is_before(value: Any, limit_ms: float) -> bool:
    try:
        return to_ms(value) < limit_ms
    except AttributeError:
        return False  # no time


def _forget(index: dict[Hashable, dict[Hashable, None]], keys: set[Hashable], identity: Hashable) -> None:
    for each in keys:
        known = index[each]
        known.pop(identity, None)
        if not known:
            del index[each]
