"""Change streams of MongoDB that survive disconnections.

A change stream reports the changes of a collection from the oplog, the log of a replica set. Each event has a
token. A lost stream is opened again after the token of the last event that was read, so that no event is
missed while the oplog contains it.
"""

from __future__ import annotations

import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from pymongo.change_stream import CollectionChangeStream
from pymongo.collection import Collection
from pymongo.errors import OperationFailure, PyMongoError

from cxbridge_robot_memory.mongodb.bsonvalues import from_bson
from cxbridge_robot_memory.store import ChangeCallback, Watch
from cxbridge_robot_memory.values import Document

_AWAIT_MS = 200  # milliseconds of one wait, between checks for the end of the watch
_RETRY_S = 0.5  # seconds before a lost stream is opened again
_REPORTED_TYPES = {"insert", "update", "replace", "delete"}


class MongoWatch(Watch):
    """Reports inserted, updated, replaced and deleted documents of a collection, in a separate thread.

    :param pipeline: the stages of an aggregation that select among these events; empty for all.
    :param warn: called on disconnection and reconnection.
    :param on_close: called when the watch is closed.
    :raises PyMongoError: if the stream cannot be opened now.
    """

    def __init__(
        self,
        collection: Collection[Document],
        pipeline: Sequence[Mapping[str, Any]],
        on_change: ChangeCallback,
        warn: Callable[[str], object],
        on_close: Callable[[MongoWatch], object],
    ) -> None:
        self._collection = collection
        self._pipeline = list(pipeline)
        self._on_change = on_change
        self._warn = warn
        self._on_close = on_close
        self._end = threading.Event()
        self._token: Mapping[str, Any] | None = None
        stream = self._open()
        self._thread = threading.Thread(
            target=self._report_changes, args=(stream,), name="robot-memory-watch", daemon=True
        )
        self._thread.start()

    def close(self) -> None:
        self._end.set()
        if self._thread is not threading.current_thread():  # a callback may close its own watch
            self._thread.join()
        self._on_close(self)

    def _open(self) -> CollectionChangeStream[Document]:
        """Open the stream after the last event that was read; without a token, at present."""
        # unlike resume_after, start_after continues after a dropped collection has ended the stream
        return self._collection.watch(
            self._pipeline,
            full_document="updateLookup",
            max_await_time_ms=_AWAIT_MS,
            start_after=self._token,
        )

    def _report_changes(self, stream: CollectionChangeStream[Document] | None) -> None:
        """Report changes until the watch is closed. Runs in the thread of the watch."""
        is_lost = False
        while not self._end.is_set():
            try:
                stream = stream or self._open()
                if is_lost:
                    self._warn(f"{self._collection.full_name}: the database is reachable again")
                    is_lost = False
                self._report_new_changes(stream)
            except PyMongoError as error:
                if not is_lost:
                    self._warn(f"{self._collection.full_name}: no events at present: {error}")
                    is_lost = True
                if isinstance(error, OperationFailure) and not error.has_error_label(
                    "ResumableChangeStreamError"
                ):
                    # The error would repeat with the token, e.g. if the oplog no longer contains its event.
                    # The new stream begins at present: the events in between are lost.
                    self._token = None
                self._end.wait(_RETRY_S)
            # an error, or the removal of the collection, may have ended the stream
            stream = None if stream is None or not stream.alive else stream
        if stream is not None:
            stream.close()

    def _report_new_changes(self, stream: CollectionChangeStream[Document]) -> None:
        """Report the events of a stream until it ends or the watch is closed."""
        while not self._end.is_set():
            change = stream.try_next()
            self._token = stream.resume_token or self._token
            if change is None:
                if not stream.alive:
                    return
                continue
            if change.get("operationType") in _REPORTED_TYPES:
                self._on_change(from_bson(change))
