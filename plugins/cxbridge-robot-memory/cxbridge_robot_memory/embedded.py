"""The store in this process: documents in memory, optionally persistent in a file.

Each write of a document has the same steps: check the document, write the file, change the memory, report the
change. A deletion omits the check. After an error in one of the first two steps, the memory has the document
as before.
"""

from __future__ import annotations

import os
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from datetime import datetime
from pathlib import Path
from typing import Any

from cxbridge.clock import Clock
from cxbridge_robot_memory.collection import Collection
from cxbridge_robot_memory.document_file import DocumentFile
from cxbridge_robot_memory.errors import QueryError
from cxbridge_robot_memory.query import (
    Matcher,
    compile_query,
    mongodb_needed_error,
    parse_order,
    sort_documents,
)
from cxbridge_robot_memory.store import ChangeCallback, ChangeEvent, Store, Watch, split_name
from cxbridge_robot_memory.update import Update
from cxbridge_robot_memory.values import Document, ObjectId, Regex, Timestamp, from_ms, validated_copy


class _LocalWatch(Watch):
    """A subscription to the changes that this process makes in a collection."""

    def __init__(
        self, matches: Matcher, on_change: ChangeCallback, on_close: Callable[[_LocalWatch], None]
    ) -> None:
        self.matches = matches
        self.on_change = on_change
        self._on_close = on_close

    def close(self) -> None:
        self._on_close(self)


class EmbeddedStore(Store):
    """Documents in this process. Several executives may share one store.

    :param clock: the source of dates, ``_id`` and ``clusterTime``, which makes runs on a virtual clock
        reproducible.
    :param file: the file of a persistent store; None keeps the documents in memory only.
    :raises RobotMemoryError: if the file cannot be used.
    """

    is_local = True

    def __init__(self, clock: Clock, file: Path | None = None) -> None:
        self._clock = clock
        self._lock = threading.RLock()  # reentrant, because a callback of a write may end its watch
        self._collections: dict[str, Collection] = {}
        self._watches: dict[str, list[_LocalWatch]] = {}
        # an ObjectId has 4 bytes of time, 5 bytes of the process, 3 bytes of a counter; runs on a virtual
        # clock must be reproducible, so their processes have the same bytes
        self._process_digits = (bytes(5) if clock.is_virtual else os.urandom(5)).hex()
        self._id_count = 0
        self._last_stamp = Timestamp(0, 0)
        self._document_file = None if file is None else DocumentFile(file)
        if self._document_file is not None:
            # `_ensure_collection` also refuses a damaged name of a collection
            self._document_file.load_documents(
                lambda collection, document: self._ensure_collection(collection).store_document(document)
            )

    def find(
        self,
        collection: str,
        query: Mapping[str, Any] | None = None,
        *,
        sort: Mapping[str, int] | None = None,
    ) -> list[Document]:
        order = parse_order(sort) if sort else None
        with self._lock:
            documents = list(self._ensure_collection(collection).find(validated_copy(query or {})))
            if order is not None:
                documents = sort_documents(documents, order)
            return [validated_copy(document) for document in documents]

    def insert(self, collection: str, document: Mapping[str, Any]) -> Any:
        with self._lock:
            return self._insert(collection, validated_copy(document))["_id"]

    def update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> int:
        criteria, update = validated_copy(query), Update(validated_copy(changes))
        with self._lock:
            documents = list(self._ensure_collection(collection).find(criteria))
            for document in documents:
                self._apply_update(collection, document, update)
            if not documents and upsert:
                self._upsert(collection, criteria, update)
                return 1
            return len(documents)

    def find_one_and_update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> Document | None:
        criteria, update = validated_copy(query), Update(validated_copy(changes))
        with self._lock:
            document = next(self._ensure_collection(collection).find(criteria), None)
            if document is not None:
                return validated_copy(self._apply_update(collection, document, update))
            return validated_copy(self._upsert(collection, criteria, update)) if upsert else None

    def remove(self, collection: str, query: Mapping[str, Any]) -> int:
        criteria = validated_copy(query)
        with self._lock:
            documents = list(self._ensure_collection(collection).find(criteria))
            for document in documents:
                self._delete(collection, document)
            return len(documents)

    def create_index(
        self,
        collection: str,
        keys: Mapping[str, int],
        *,
        unique: bool = False,
        expire_after_s: float | None = None,
    ) -> None:
        """Check the keys. Queries make their indexes themselves."""
        split_name(collection)
        parse_order(keys, "index")
        if unique or expire_after_s is not None:
            raise mongodb_needed_error("a unique or expiring index")

    def watch(self, collection: str, query: Mapping[str, Any], on_change: ChangeCallback) -> Watch:
        split_name(collection)
        watch = _LocalWatch(
            compile_query(validated_copy(query)),
            on_change,
            lambda ended_watch: self._end_watch(collection, ended_watch),
        )
        with self._lock:
            self._watches.setdefault(collection, []).append(watch)
        return watch

    def _end_watch(self, collection: str, watch: _LocalWatch) -> None:
        with self._lock, suppress(KeyError, ValueError):  # watch or store may have ended already
            self._watches[collection].remove(watch)

    def close(self) -> None:
        with self._lock:
            self._watches.clear()
            if self._document_file is not None:
                self._document_file.close()
                self._document_file = None

    # the methods below require that the caller holds the lock

    def _ensure_collection(self, collection: str) -> Collection:
        if collection not in self._collections:
            split_name(collection)  # refuses an invalid name
            self._collections[collection] = Collection()
        return self._collections[collection]

    def _insert(self, collection: str, document: Document) -> Document:
        # a document with an _id uses up a new id, too, so that later ids do not depend on such documents
        new_id = self._new_id()
        document = {"_id": document.pop("_id", new_id), **document}
        if isinstance(document["_id"], list | Regex):
            raise QueryError("the '_id' of a document must not be an array or a regular expression")
        self._store_document(collection, document)
        self._notify(collection, "insert", document)
        return document

    def _store_document(
        self, collection: str, document: Document, stored_document: Document | None = None
    ) -> None:
        """Check a document, and add the document or replace a stored document with the same ``_id``."""
        target = self._ensure_collection(collection)
        _refuse_dollars(document)
        if stored_document is None:
            target.check_new_id(document)
        if self._document_file is not None:
            self._document_file.store_document(collection, document)
        target.store_document(document, stored_document)

    def _upsert(self, collection: str, query: Document, update: Update) -> Document:
        return self._insert(collection, update.new_document(query, self._present_time()))

    def _apply_update(self, collection: str, document: Document, update: Update) -> Document:
        """Update a stored document; return its new version, or the same document if nothing changes."""
        changed_document = update.apply(document, self._present_time())
        if changed_document is None:
            return document
        self._store_document(collection, changed_document, document)
        self._notify(collection, "update", changed_document)
        return changed_document

    def _delete(self, collection: str, document: Document) -> None:
        if self._document_file is not None:
            self._document_file.delete_document(collection, document["_id"])
        self._ensure_collection(collection).delete(document)
        self._notify(collection, "delete", document)

    def _new_id(self) -> ObjectId:
        self._id_count = (self._id_count + 1) % (1 << 24)
        seconds = self._clock.now_us() // 1_000_000 & 0xFFFFFFFF
        return ObjectId(f"{seconds:08x}{self._process_digits}{self._id_count:06x}")

    def _present_time(self) -> datetime:
        return from_ms(self._clock.now_us() // 1000)

    def _next_stamp(self) -> Timestamp:
        """Return a timestamp greater than all earlier timestamps."""
        seconds, number = self._clock.now_us() // 1_000_000, 1
        if self._last_stamp.time >= seconds:
            seconds, number = self._last_stamp.time, self._last_stamp.inc + 1
        self._last_stamp = Timestamp(seconds, number)
        return self._last_stamp

    def _notify(self, collection: str, operation: str, document: Document) -> None:
        """Report a change to the watches whose queries match the event.

        :param operation: ``insert``, ``update`` or ``delete``.
        """
        stamp = self._next_stamp()
        watches = self._watches.get(collection)
        if not watches:
            return
        # the fields of MongoDB's change events, in MongoDB's order
        database, name = split_name(collection)
        change: ChangeEvent = {
            "_id": {"_data": f"{stamp.time:08x}{stamp.inc:08x}"},
            "operationType": operation,
            "clusterTime": stamp,
            "wallTime": self._present_time(),
        }
        if operation != "delete":
            change["fullDocument"] = document
        change["ns"] = {"db": database, "coll": name}
        change["documentKey"] = {"_id": document["_id"]}
        for watch in tuple(watches):  # a callback may end its watch
            if watch.matches(change):
                watch.on_change(validated_copy(change))


def _refuse_dollars(value: Any) -> None:
    """Refuse field names with a dollar at the start, which the reader of extended JSON takes for types.

    :raises QueryError: if a document in the value has such a field.
    """
    if isinstance(value, dict):
        for name, item in value.items():
            if name.startswith("$"):
                raise QueryError(f"'{name}': a field name must not begin with a dollar")
            _refuse_dollars(item)
    elif isinstance(value, list):
        for item in value:
            _refuse_dollars(item)
