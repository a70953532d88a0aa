"""Dumps of collections as files of mongodump: ``DIR/DATABASE/COLLECTION.bson``, documents in BSON."""

from __future__ import annotations

from pathlib import Path
from types import ModuleType

from cxbridge.errors import CxbridgeError
from cxbridge.file_access import replaced_file
from cxbridge_robot_memory.errors import QueryError, RobotMemoryError, mongodb_install_command
from cxbridge_robot_memory.store import Store, split_name


def dump_collection(store: Store, collection: str, folder: Path) -> Path:
    """Write all documents of a collection atomically; return the file.

    :raises RobotMemoryError: if the file cannot be written, the name of the collection is invalid or contains
        a slash, or the package pymongo is missing.
    """
    file = _dump_file(collection, folder)
    bson_bytes = _import_bsonvalues(file).encode_dump(store.find(collection))
    try:
        with replaced_file(file) as new_file:
            new_file.write_bytes(bson_bytes)
    except CxbridgeError as error:
        raise RobotMemoryError(f"cannot dump {collection}: {error.message}", file=file) from None
    return file


def restore_collection(store: Store, collection: str, folder: Path, target: str = "") -> int:
    """Replace a collection with its dump; return the number of documents.

    :param target: the replaced collection; empty: ``collection``.
    :raises RobotMemoryError: if the file cannot be read or is not a dump, a name is invalid, the name of the
        dumped collection contains a slash, or the package pymongo is missing.
    """
    # the whole file is read and checked before any document is removed
    file = _dump_file(collection, folder)
    try:
        bson_bytes = file.read_bytes()
    except OSError as error:
        raise RobotMemoryError(f"cannot restore {collection}: {error.strerror}", file=file) from None
    try:
        documents = _import_bsonvalues(file).decode_dump(bson_bytes)
    except QueryError as error:
        raise RobotMemoryError(f"this is not a dump of a collection: {error}", file=file) from None
    destination = target or collection
    store.remove(destination, {})
    for document in documents:
        store.insert(destination, document)
    return len(documents)


def _import_bsonvalues(file: Path) -> ModuleType:
    try:
        from cxbridge_robot_memory.mongodb import bsonvalues  # noqa: PLC0415 - an optional dependency
    except ModuleNotFoundError:
        raise RobotMemoryError(
            "files of mongodump require the package pymongo",
            file=file,
            hint=mongodb_install_command(),
        ) from None
    return bsonvalues


def _dump_file(collection: str, folder: Path) -> Path:
    database, name = split_name(collection)
    if "/" in collection:
        raise RobotMemoryError(f"collection '{collection}' cannot be dumped: its name contains a slash")
    return folder / database / f"{name}.bson"
