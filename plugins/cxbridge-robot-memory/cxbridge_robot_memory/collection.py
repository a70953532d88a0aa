"""A collection of the embedded store, with its indexes."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping
from typing import Any

from cxbridge_robot_memory.errors import DuplicateKeyError
from cxbridge_robot_memory.query import compile_query, equalities, leaf_reader
from cxbridge_robot_memory.values import Document, order_key

# Up to this number of documents, a query uses no index: for few documents, a scan is faster.
_MAX_SCANNED = 32

# The maximum number of automatic indexes, because each index slows down writes.
_MAX_INDEXES = 16


class Collection:
    """The documents of a collection, in insertion order."""

    # agents repeat the same queries, so a query for equality indexes its path automatically; an index maps
    # the key of a value (see `order_key`) to the identities (keys of `_id`) of the documents with that value,
    # in a dictionary because sets have no order
    def __init__(self) -> None:
        self._documents: dict[Hashable, Document] = {}
        self._indexes: dict[str, dict[Hashable, dict[Hashable, None]]] = {}

    def find(self, query: Mapping[str, Any]) -> Iterator[Document]:
        """Yield the matching stored documents. The collection must not change during the iteration.

        :raises QueryError: if the query is invalid.
        """
        matches = compile_query(query)
        return (document for document in self._find_candidates(query) if matches(document))

    def _find_candidates(self, query: Mapping[str, Any]) -> Iterable[Document]:
        """Return a superset of the matching documents.

        The order is that of the insertions, except in an index: there, a document comes last if an update
        gave it the value.
        """
        if not query:
            return self._documents.values()
        required_equalities = list(equalities(query))
        for path, value in required_equalities:
            if path == "_id":
                document = self._documents.get(order_key(value))
                return () if document is None else (document,)
        if len(self._documents) <= _MAX_SCANNED:
            return self._documents.values()
        candidate_identities = [
            index.get(order_key(value), {})
            for path, value in required_equalities
            if (index := self._ensure_index(path)) is not None
        ]
        if not candidate_identities:
            return self._documents.values()
        return (self._documents[identity] for identity in min(candidate_identities, key=len))

    def _ensure_index(self, path: str) -> dict[Hashable, dict[Hashable, None]] | None:
        """Return the index of a path, created if necessary; None if there are too many to create it."""
        index = self._indexes.get(path)
        if index is None and len(self._indexes) < _MAX_INDEXES:
            index = self._indexes[path] = {}
            for identity, document in self._documents.items():
                for key in _leaf_keys(document, path):
                    index.setdefault(key, {})[identity] = None
        return index

    def check_new_id(self, document: Document) -> None:
        """Check that no document has the same ``_id``.

        :raises DuplicateKeyError: if a document has the same ``_id``.
        """
        if order_key(document["_id"]) in self._documents:
            raise DuplicateKeyError(f"a document with the _id {document['_id']!r} already exists")

    def store_document(self, document: Document, stored_document: Document | None = None) -> None:
        """Add a document after :meth:`check_new_id`, or replace a stored document with the same ``_id``.

        :param stored_document: the replaced document; None to add a document.
        """
        identity = order_key(document["_id"])
        for path, index in self._indexes.items():
            old_keys = set() if stored_document is None else _leaf_keys(stored_document, path)
            new_keys = _leaf_keys(document, path)
            _remove_from_index(index, old_keys - new_keys, identity)
            for key in new_keys - old_keys:
                index.setdefault(key, {})[identity] = None
        self._documents[identity] = document

    def delete(self, document: Document) -> None:
        """Remove a stored document."""
        identity = order_key(document["_id"])
        for path, index in self._indexes.items():
            _remove_from_index(index, _leaf_keys(document, path), identity)
        del self._documents[identity]


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
