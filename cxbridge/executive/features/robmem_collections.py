"""The ``robmem-*`` functions: read, write, watch, dump and restore collections from CLIPS."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cxbridge.errors import ClipsError
from cxbridge.executive.features.robmem_context import FAIL, SUCCESS, RobotMemoryContext
from cxbridge.executive.features.robmem_handles import Cursor, Trigger, pointer_symbol
from cxbridge.executive.host.environment import ClipsEnvironment
from cxbridge.executive.host.values import FALSE, TRUE, ExternalAddress, Value
from cxbridge.executive.robmem import jsontext
from cxbridge.executive.robmem.dump import dump_collection, restore_collection
from cxbridge.executive.robmem.errors import DuplicateKeyError, RobotMemoryError
from cxbridge.executive.robmem.values import Document, copy


class CollectionFunctions:
    """Defines the functions in an environment. Errors are logged, as in Fawkes.

    :param folder: resolves a folder named by rules.
    """

    def __init__(
        self, env: ClipsEnvironment, context: RobotMemoryContext, folder: Callable[[str], Path]
    ) -> None:
        self._context = context
        self._store = context.store
        self._handles = context.handles
        self._log = context.log
        self._folder = folder
        for name, function, types in (
            ("robmem-insert", self.insert, "*;sy"),
            ("robmem-update", self.update, "*;sy"),
            ("robmem-upsert", self.upsert, "*;sy"),
            ("robmem-replace", self.update, "*;sy"),
            ("robmem-remove", self.remove, "*;sy"),
            ("robmem-query", self.query, "*;sy"),
            ("robmem-query-sort", self.query_sort, "*;sy"),
            ("robmem-cursor-next", self.cursor_next, "*"),
            ("robmem-cursor-more", self.cursor_more, "*"),
            ("robmem-cursor-destroy", self.cursor_destroy, "*"),
            ("robmem-create-index", self.create_index, "*;sy"),
            ("robmem-create-unique-index", self.create_unique_index, "*;sy"),
            ("robmem-dump-collection", self.dump, "*;sy;sy"),
            ("robmem-restore-collection", self.restore, "*;sy;sy;sy"),
            ("robmem-trigger-register", self.trigger_register, "*;sy;*;sy"),
            ("robmem-trigger-destroy", self.trigger_destroy, "*"),
        ):
            env.define(name, function, function.__code__.co_argcount - 1, types=types)

    def insert(self, collection: str, doc: Value) -> None:
        def insert() -> bool:
            self._store.insert(collection, self._document(doc, "robmem-insert"))
            return True

        self._attempt("Insert", insert)

    def update(self, collection: str, doc: Value, query: Value) -> None:
        """Set the fields of ``doc`` in all matching documents."""
        self._update(collection, doc, query, upsert=False)

    def upsert(self, collection: str, doc: Value, query: Value) -> None:
        """Set the fields of ``doc`` in all matching documents; insert a document if none matches."""
        self._update(collection, doc, query, upsert=True)

    def _update(self, collection: str, doc: Value, query: Value, *, upsert: bool) -> None:
        def update() -> bool:
            changes = self._document(doc, "robmem-upsert" if upsert else "robmem-update")
            wanted = self._query(query)
            if not changes:
                return True  # nothing to set
            try:
                self._store.update(collection, wanted, {"$set": changes}, upsert=upsert)
            except DuplicateKeyError as error:
                # rules of wm-robmem-sync detect by this that another agent has a newer document
                self._log.debug(f"Update of {collection} refused: {error}")
            return True

        self._attempt("Update", update)

    def remove(self, collection: str, query: Value) -> None:
        """Remove the matching documents."""

        def remove() -> bool:
            self._store.remove(collection, self._document(query, "robmem-remove"))
            return True

        self._attempt("Remove", remove)

    def create_index(self, collection: str, keys: Value) -> None:
        self._index(collection, keys, unique=False)

    def create_unique_index(self, collection: str, keys: Value) -> None:
        """Create an index that rejects duplicate values."""
        self._index(collection, keys, unique=True)

    def _index(self, collection: str, keys: Value, *, unique: bool) -> None:
        def create() -> bool:
            self._store.create_index(collection, self._document(keys, "robmem-create-index"), unique=unique)
            return True

        self._attempt("Creating unique index" if unique else "Creating index", create)

    def query(self, collection: str, query: Value) -> Value:
        """Return a cursor over the matching documents."""
        return self._find(collection, query, None)

    def query_sort(self, collection: str, query: Value, order: Value) -> Value:
        """Return a cursor over the sorted matching documents."""
        return self._find(collection, query, order)

    def _find(self, collection: str, query: Value, order: Value) -> Value:
        try:
            wanted = self._document(query, "robmem-query")
            sort = None if order is None else self._document(order, "robmem-query-sort")
            return self._handles.add(Cursor(self._store.find(collection, wanted, sort=sort)))
        except (ClipsError, RobotMemoryError) as error:
            self._log.warn(f"Query failed: {error}")
            return FALSE

    def cursor_next(self, cursor: Value) -> Value:
        """Return the next document, or FALSE at the end."""
        try:
            found = next(self._handles.get(cursor, Cursor, "robmem-cursor-next").documents, None)
        except ClipsError as error:
            self._log.error(str(error))
            return FALSE
        return FALSE if found is None else self._handles.add(found)

    def cursor_more(self, _cursor: Value) -> None:
        """Raise an error, as in Fawkes. It ends the right-hand side."""
        raise ClipsError(
            "robmem-cursor-more is no longer supported", hint="robmem-cursor-next is FALSE at the end"
        )

    def cursor_destroy(self, cursor: Value) -> None:
        try:
            self._handles.take(cursor, Cursor, "robmem-cursor-destroy")
        except ClipsError as error:
            self._log.error(str(error))

    def dump(self, collection: str, directory: str) -> Value:
        """Write a collection to a folder; return TRUE on success."""

        def dump() -> bool:
            dump_collection(self._store, collection, self._folder(directory))
            return True

        return TRUE if self._attempt(f"Dumping collection {collection} to {directory}", dump) else FALSE

    def restore(self, collection: str, directory: str, target: str) -> Value:
        """Replace a collection by its dump; return TRUE on success."""

        def restore() -> bool:
            restore_collection(self._store, collection, self._folder(directory), target)
            return True

        return (
            TRUE if self._attempt(f"Restoring collection {collection} from {directory}", restore) else FALSE
        )

    def trigger_register(self, collection: str, query: Value, name: str) -> Value:
        """Register a trigger for changes of a collection. A feedback fact reports success."""
        try:
            wanted = copy(self._document(query, "robmem-trigger-register"))
        except ClipsError as error:
            self._log.error(str(error))
            self._answer(name, None)
            return FALSE
        trigger = Trigger(name)

        def register() -> None:
            try:
                watch = self._store.watch(
                    collection, wanted, lambda change: self._context.enqueue_event(name, change)
                )
            except RobotMemoryError as error:
                self._log.warn(f"Error while registering trigger: {error}")
                self._answer(name, None)
                return
            trigger.watch = watch
            self._answer(name, trigger)

        if not self._context.start(f"register_trigger_{name}", register):
            self._answer(name, None)
            return FALSE
        return TRUE

    def _answer(self, name: str, trigger: Trigger | None) -> None:
        relation = "mutex-trigger-register-feedback"
        if trigger is None:
            self._context.enqueue_fact(relation, FAIL, name)
        else:
            self._context.enqueue_fact(relation, SUCCESS, name, pointer_symbol(self._handles.add(trigger)))

    def trigger_destroy(self, trigger: Value) -> None:
        """Remove a trigger."""
        try:
            self._handles.take(trigger, Trigger, "robmem-trigger-destroy").close()
        except ClipsError as error:
            self._log.error(str(error))

    def _document(self, address: Value, function: str) -> Document:
        """Return the document behind an address."""
        document: Document = self._handles.get(address, dict, function)
        return document

    def _query(self, query: Value) -> Document:
        """Return a query, given as document or JSON."""
        if isinstance(query, ExternalAddress):
            return self._document(query, "robmem-update: query")
        if isinstance(query, str):
            return jsontext.parse(query)
        raise ClipsError("Invalid query, must be string or BSON document")

    def _attempt(self, name: str, operation: Callable[[], bool]) -> bool:
        try:
            return self._context.attempt(name, operation)
        except ClipsError as error:
            self._log.warn(f"{name} failed: {error}")
            return False
