"""The store on MongoDB, for robots that share a memory. Change streams need a replica set."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

import bson
import pymongo
from pymongo import MongoClient, ReadPreference, ReturnDocument
from pymongo import errors as mongo_errors
from pymongo.collection import Collection

from cxbridge.config.secrets import mask
from cxbridge.errors import ConfigError
from cxbridge_robot_memory.errors import (
    DuplicateKeyError,
    QueryError,
    RobotMemoryError,
    UnreachableError,
)
from cxbridge_robot_memory.mongodb.bsonvalues import CODEC, from_bson, to_bson
from cxbridge_robot_memory.mongodb.change_stream import MongoWatch
from cxbridge_robot_memory.store import ChangeCallback, ReplicaSetStatus, Store, Watch, split_name
from cxbridge_robot_memory.update import to_operators
from cxbridge_robot_memory.values import Document

Client = MongoClient[Document]

_SELECTION_MS = 2000  # milliseconds until an absent server is reported
_SOCKET_MS = 10_000  # milliseconds until a server without reply is reported
# Seconds in which calls fail immediately after a failure, so that rules do not wait at every call.
_PAUSE_S = 1.0

_DUPLICATE_KEY = 11000  # MongoDB's code of the error


def make_client(uri: str) -> Client:
    """Make a client, which connects on first use.

    :raises ConfigError: if the URI is invalid.
    """
    try:
        return MongoClient(
            uri,
            w="majority",  # an acknowledged write is not lost if another server becomes the primary
            serverSelectionTimeoutMS=_SELECTION_MS,
            connectTimeoutMS=_SELECTION_MS,
            socketTimeoutMS=_SOCKET_MS,
            appname="cxbridge",
        )
    except (mongo_errors.PyMongoError, ValueError, TypeError) as error:
        raise ConfigError(
            f"cannot use the MongoDB '{mask('', uri)}': {error}",
            hint="e.g. mongodb://host:27021/?replicaSet=robot-memory",
        ) from None


class MongoStore(Store):
    """Documents in one or two MongoDB replica sets.

    :param local_uri: the URI of the robot's set.
    :param distributed_uri: the URI of the set that robots share; empty if they share the robot's set.
    :param shared_databases: the databases in the shared set.
    :param warn: called when a watch is disconnected or reconnected.
    :raises ConfigError: if a URI is invalid.
    """

    is_local = False

    def __init__(
        self,
        local_uri: str,
        distributed_uri: str = "",
        shared_databases: Sequence[str] = (),
        *,
        warn: Callable[[str], object] = lambda _text: None,
    ) -> None:
        self._local_client = make_client(local_uri)
        self._distributed_client = make_client(distributed_uri) if distributed_uri else self._local_client
        self._shared_databases = frozenset(shared_databases)
        self._warn = warn
        self._paused_until: dict[int, float] = {}  # end of the pause after a failure, by id() of the client
        self._watches: set[MongoWatch] = set()

    def insert(self, collection: str, document: Mapping[str, Any]) -> Any:
        bson_document = to_bson(document)  # pymongo adds the _id to its argument
        with self._open_collection(collection) as mongo_collection:
            return from_bson(mongo_collection.insert_one(bson_document).inserted_id)

    def update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> int:
        criteria, operators = to_bson(query), to_bson(to_operators(changes))
        with self._open_collection(collection) as mongo_collection:
            result = mongo_collection.update_many(criteria, operators, upsert=upsert)
            return result.matched_count or int(result.upserted_id is not None)

    def find_one_and_update(
        self, collection: str, query: Mapping[str, Any], changes: Mapping[str, Any], *, upsert: bool = False
    ) -> Document | None:
        criteria, operators = to_bson(query), to_bson(to_operators(changes))
        with self._open_collection(collection) as mongo_collection:
            document: Document | None = mongo_collection.find_one_and_update(
                criteria, operators, upsert=upsert, return_document=ReturnDocument.AFTER
            )
            return None if document is None else from_bson(document)

    def find(
        self,
        collection: str,
        query: Mapping[str, Any] | None = None,
        *,
        sort: Mapping[str, int] | None = None,
    ) -> list[Document]:
        order = list(sort.items()) if sort else None
        with self._open_collection(collection) as mongo_collection:
            documents = mongo_collection.find(to_bson(query or {}), sort=order)
            return [from_bson(document) for document in documents]

    def remove(self, collection: str, query: Mapping[str, Any]) -> int:
        with self._open_collection(collection) as mongo_collection:
            return mongo_collection.delete_many(to_bson(query)).deleted_count

    def create_index(
        self,
        collection: str,
        keys: Mapping[str, int],
        *,
        unique: bool = False,
        expire_after_s: float | None = None,
    ) -> None:
        options: dict[str, Any] = {"unique": True} if unique else {}
        if expire_after_s is not None:
            options["expireAfterSeconds"] = int(expire_after_s)
        with self._open_collection(collection) as mongo_collection:
            mongo_collection.create_index(list(keys.items()), **options)

    def watch(self, collection: str, query: Mapping[str, Any], on_change: ChangeCallback) -> Watch:
        pipeline = [{"$match": to_bson(query)}] if query else []
        with self._open_collection(collection) as mongo_collection:
            watch = MongoWatch(mongo_collection, pipeline, on_change, self._warn, self._watches.discard)
        self._watches.add(watch)
        return watch

    def replica_set_status(self, name: str) -> ReplicaSetStatus:
        """Return the status of a replica set, as one of its servers reports it.

        Without a reply, the status is ``UNKNOWN`` with the error.
        """
        # Fawkes' names of the sets are robot-memory-distributed and robot-memory-local
        client = self._distributed_client if name.endswith("distributed") else self._local_client
        try:
            hello = client.admin.command("hello", read_preference=ReadPreference.NEAREST)
        except mongo_errors.PyMongoError as error:
            return ReplicaSetStatus("UNKNOWN", "PRIMARY_UNKNOWN", f"{name}: {error}")
        if "setName" not in hello:
            return ReplicaSetStatus(
                "NOT_INITIALIZED",
                "NO_PRIMARY",
                f"{name}: this MongoDB is not a replica set, so it reports no changes",
            )
        # the field of the reply is true for a server with the role
        roles_by_field = {"isWritablePrimary": "PRIMARY", "secondary": "SECONDARY", "arbiterOnly": "ARBITER"}
        return ReplicaSetStatus(
            next((role for field, role in roles_by_field.items() if hello.get(field)), "INITIALIZING"),
            "HAVE_PRIMARY" if hello.get("primary") else "NO_PRIMARY",
            "",
        )

    def close(self) -> None:
        for watch in tuple(self._watches):
            watch.close()
        self._local_client.close()
        self._distributed_client.close()

    @contextmanager
    def _open_collection(self, collection: str) -> Iterator[Collection[Document]]:
        """Provide a collection, and convert the errors of pymongo.

        :raises UnreachableError: if the connection fails or the database takes too long, and at once in the
            pause after such a failure.
        :raises QueryError: if the name is invalid, values cannot be encoded, or the database reports another
            error.
        :raises DuplicateKeyError: if a document with the ``_id`` or with a unique value exists.
        """
        database, name = split_name(collection)
        client = self._distributed_client if database in self._shared_databases else self._local_client
        if time.monotonic() < self._paused_until.get(id(client), 0.0):
            raise UnreachableError("the database cannot be reached")
        try:
            yield client[database].get_collection(name, codec_options=CODEC)
        except mongo_errors.PyMongoError as error:
            memory_error = _convert_error(error)
            if isinstance(memory_error, UnreachableError):
                self._paused_until[id(client)] = time.monotonic() + _PAUSE_S
            raise memory_error from None
        except (bson.errors.BSONError, OverflowError, TypeError, ValueError) as error:
            raise QueryError(str(error)) from None


def _convert_error(error: pymongo.errors.PyMongoError) -> RobotMemoryError:
    """Return the robot memory's error for an error of pymongo."""
    # this includes the errors of the class DuplicateKeyError in pymongo
    if isinstance(error, mongo_errors.OperationFailure) and error.code == _DUPLICATE_KEY:
        return DuplicateKeyError(str(error))
    if isinstance(error, mongo_errors.ConnectionFailure | mongo_errors.ExecutionTimeout):
        # after the reason, pymongo adds the timeout and a description of all servers
        return UnreachableError(f"the database cannot be reached: {error}".split(", Timeout:")[0])
    return QueryError(str(error))
