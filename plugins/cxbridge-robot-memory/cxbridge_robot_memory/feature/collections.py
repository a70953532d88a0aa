"""The ``robmem-*`` functions: read, write, watch, dump and restore collections from CLIPS."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

from cxbridge.errors import ClipsError, CxbridgeError
from cxbridge.executive.feature import define_logged
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Value
from cxbridge_robot_memory import jsontext
from cxbridge_robot_memory.dump import dump_collection, restore_collection
from cxbridge_robot_memory.errors import DuplicateKeyError, RobotMemoryError
from cxbridge_robot_memory.feature.context import FAIL, SUCCESS, RobotMemoryContext
from cxbridge_robot_memory.feature.handles import Cursor, Trigger, pointer_symbol
from cxbridge_robot_memory.values import Document, validated_copy


class CollectionFunctions:
    """Defines the functions in an environment. Errors are logged, as in Fawkes.

    :param expand_path: returns the path of a folder that a rule names, with values in place of placeholders.
    """

    def __init__(
        self, env: ClipsEnvironment, context: RobotMemoryContext, expand_path: Callable[[str], Path]
    ) -> None:
        self._context = context
        self._store = context.store
        self._handles = context.handles
        self._log = context.log
        self._expand_path = expand_path
        # the types are CLIPS' codes for the arguments: any by default (*); `sy` is a string or a symbol;
        # after an error the function returns `failure`, and a warning begins with the operation, or
        # without an operation an error is logged
        for name, function, types, failure, operation in (
            ("robmem-insert", self.insert, "*;sy", None, "Insert"),
            ("robmem-update", self.update, "*;sy", None, "Update"),
            ("robmem-upsert", self.upsert, "*;sy", None, "Update"),
            # as in Fawkes, whose robmem-replace updates documents
            ("robmem-replace", self.update, "*;sy", None, "Update"),
            ("robmem-remove", self.remove, "*;sy", None, "Remove"),
            ("robmem-query", self.query, "*;sy", FALSE, "Query"),
            ("robmem-query-sort", self.query_sort, "*;sy", FALSE, "Query"),
            ("robmem-cursor-next", self.cursor_next, "*", FALSE, ""),
            ("robmem-cursor-destroy", self.cursor_destroy, "*", None, ""),
            ("robmem-create-index", self.create_index, "*;sy", None, "Creating index"),
            ("robmem-create-unique-index", self.create_unique_index, "*;sy", None, "Creating unique index"),
            ("robmem-dump-collection", self.dump, "*;sy;sy", FALSE, "Dumping collection"),
            ("robmem-restore-collection", self.restore, "*;sy;sy;sy", FALSE, "Restoring collection"),
            ("robmem-trigger-register", self.trigger_register, "*;sy;*;sy", FALSE, ""),
            ("robmem-trigger-destroy", self.trigger_destroy, "*", None, ""),
        ):
            define_logged(env, name, function, types, failure, partial(self._log_error, operation))
        env.define("robmem-cursor-more", self.cursor_more, 1, types="*")

    def _log_error(self, operation: str, error: CxbridgeError) -> None:
        if operation:
            self._log.warn(f"{operation} failed: {error}")
        else:
            self._log.error(str(error))

    def insert(self, collection: str, doc: Value) -> None:
        self._store.insert(collection, self._document(doc, "robmem-insert"))

    def update(self, collection: str, doc: Value, query: Value) -> None:
        """Set the fields of ``doc`` in all matching documents."""
        self._update(collection, self._document(doc, "robmem-update"), query, upsert=False)

    def upsert(self, collection: str, doc: Value, query: Value) -> None:
        """Set the fields of ``doc`` in all matching documents; insert a document if none matches."""
        self._update(collection, self._document(doc, "robmem-upsert"), query, upsert=True)

    def _update(self, collection: str, fields: Document, query: Value, *, upsert: bool) -> None:
        criteria = self._parse_query(query, "robmem-upsert" if upsert else "robmem-update")
        if not fields:  # MongoDB refuses a $set without fields before version 5
            return
        try:
            self._store.update(collection, criteria, {"$set": fields}, upsert=upsert)
        except DuplicateKeyError as error:
            # expected: wm-robmem-sync upserts with a query that matches no document if another agent has
            # written a newer document
            self._log.debug(f"Update of {collection} refused: {error}")

    def remove(self, collection: str, query: Value) -> None:
        """Remove the matching documents."""
        self._store.remove(collection, self._document(query, "robmem-remove"))

    def create_index(self, collection: str, keys: Value) -> None:
        self._store.create_index(collection, self._document(keys, "robmem-create-index"))

    def create_unique_index(self, collection: str, keys: Value) -> None:
        """Create an index that rejects duplicate values."""
        self._store.create_index(collection, self._document(keys, "robmem-create-unique-index"), unique=True)

    def query(self, collection: str, query: Value) -> Value:
        """Return a cursor over the matching documents."""
        return self._handles.add(Cursor(self._store.find(collection, self._document(query, "robmem-query"))))

    def query_sort(self, collection: str, query: Value, order: Value) -> Value:
        """Return a cursor over the sorted matching documents."""
        return self._handles.add(
            Cursor(
                self._store.find(
                    collection,
                    self._document(query, "robmem-query-sort"),
                    sort=self._document(order, "robmem-query-sort"),
                )
            )
        )

    def cursor_next(self, cursor: Value) -> Value:
        """Return the next document, or FALSE at the end."""
        document = next(self._handles.get(cursor, Cursor, "robmem-cursor-next").documents, None)
        return FALSE if document is None else self._handles.add(document)

    def cursor_more(self, _cursor: Value) -> None:
        """Refuse the call, which ends the right-hand side, as in Fawkes.

        :raises ClipsError: always.
        """
        raise ClipsError(
            "robmem-cursor-more is no longer supported", hint="robmem-cursor-next is FALSE at the end"
        )

    def cursor_destroy(self, cursor: Value) -> None:
        self._handles.pop(cursor, Cursor, "robmem-cursor-destroy")

    def dump(self, collection: str, directory: str) -> Value:
        """Write a collection to a folder; return TRUE on success."""
        dump_collection(self._store, collection, self._expand_path(directory))
        return TRUE

    def restore(self, collection: str, directory: str, target: str) -> Value:
        """Replace a collection with a dump; return TRUE on success.

        :param collection: the collection that was dumped.
        :param target: the replaced collection; empty: ``collection``.
        """
        restore_collection(self._store, collection, self._expand_path(directory), target)
        return TRUE

    def trigger_register(self, collection: str, query: Value, name: str) -> Value:
        """Register a trigger for changes of a collection. A feedback fact reports success or failure.

        :returns: FALSE if a trigger of this name is being registered, TRUE otherwise.
        :raises CxbridgeError: if the query is not a valid document.
        """
        try:
            criteria = validated_copy(self._document(query, "robmem-trigger-register"))
        except CxbridgeError:
            self._report_registration(name, None)
            raise
        trigger = Trigger()

        def register() -> None:
            # runs in a thread of the context if the store is remote
            try:
                trigger.watch = self._store.watch(
                    collection, criteria, lambda change: self._context.enqueue_event(name, change)
                )
            except RobotMemoryError as error:
                self._log.warn(f"Error while registering trigger: {error}")
            self._report_registration(name, trigger if trigger.watch else None)

        if self._context.start_operation(f"register_trigger_{name}", register):
            return TRUE
        self._report_registration(name, None)
        return FALSE

    def _report_registration(self, name: str, trigger: Trigger | None) -> None:
        # as in Fawkes, the feedback of all triggers has this relation, not only that of mutexes
        relation = "mutex-trigger-register-feedback"
        if trigger is None:
            self._context.enqueue_fact(relation, FAIL, name)
        else:
            self._context.enqueue_fact(relation, SUCCESS, name, pointer_symbol(self._handles.add(trigger)))

    def trigger_destroy(self, trigger: Value) -> None:
        """Remove a trigger."""
        self._handles.pop(trigger, Trigger, "robmem-trigger-destroy").close()

    def _document(self, address: Value, function: str) -> Document:
        """Return the document of an address.

        :param function: the name of the CLIPS function, for errors.
        """
        return self._handles.get(address, dict, function)

    def _parse_query(self, query: Value, function: str) -> Document:
        """Return a query that a rule gives as a document or as JSON.

        :param function: as in :meth:`_document`.
        :raises ClipsError: if the query is neither.
        """
        if isinstance(query, ExternalAddress):
            return self._document(query, f"{function}: query")
        if isinstance(query, str):
            return jsontext.parse(query)
        raise ClipsError("Invalid query, must be string or BSON document")
