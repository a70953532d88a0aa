"""Collections in files as mongodump lays them out: ``DIR/DATABASE/COLLECTION.bson``, one after another."""

from __future__ import annotations

import json
import os
from pathlib import Path

import bson

from cxbridge.errors import CxbridgeError
from cxbridge.executive.robmem.errors import RobotMemoryError
from cxbridge.executive.robmem.store import Store, split_name
from cxbridge.executive.robmem.values import Document, decode, encode
from cxbridge.file_access import replacing


def dump_collection(store: Store, collection: str, folder: Path) -> Path:
    """Write the documents of a collection; returns the file. It is there whole, or as it was before.

    :raises RobotMemoryError: when it cannot be written.
    """
    file = _file(collection, folder)
    documents = store.find(collection)
    description = json.dumps(
        {"indexes": [], "collectionName": split_name(collection)[1], "type": "collection"}
    )
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        _replace(file.with_suffix(".metadata.json"), description.encode())
        _replace(file, b"".join(encode(document) for document in documents))
    except OSError as error:
        raise RobotMemoryError(f"cannot dump {collection}: {error.strerror}", file=file) from None
    except CxbridgeError as error:
        raise RobotMemoryError(f"cannot dump {collection}: {error.message}", file=file) from None
    return file


def restore_collection(store: Store, collection: str, folder: Path, target: str = "") -> int:
    """Replace a collection by what was dumped; returns the number of documents.

    The file is read before anything is removed.

    :param target: the collection to replace, if not ``collection``.
    :raises RobotMemoryError: when the file cannot be read, or is not a dump.
    """
    file = _file(collection, folder)
    try:
        data = file.read_bytes()
    except OSError as error:
        raise RobotMemoryError(f"cannot restore {collection}: {error.strerror}", file=file) from None
    documents = _documents(data, file)
    into = target or collection
    store.drop(into)
    for document in documents:
        store.insert(into, document)
    return len(documents)


def _documents(data: bytes, file: Path) -> list[Document]:
    """Return the documents of a dump.

    :raises RobotMemoryError: when it is none.
    """
    documents, at = [], 0
    while at < len(data):
        size = int.from_bytes(data[at : at + 4], "little")
        try:
            if not 5 <= size <= len(data) - at:  # noqa: PLR2004  the smallest document: size and end
                raise bson.errors.InvalidBSON(f"a document of {size} bytes at byte {at}")
            documents.append(decode(data[at : at + size]))
        except (bson.errors.BSONError, RobotMemoryError) as error:
            raise RobotMemoryError(f"this is not a dump of a collection: {error}", file=file) from None
        at += size
    return documents


def _file(collection: str, folder: Path) -> Path:
    database, name = split_name(collection)
    if "/" in collection:
        raise RobotMemoryError(f"collection '{collection}' cannot be in a file: its name has a slash")
    return folder / database / f"{name}.bson"


def _replace(file: Path, data: bytes) -> None:
    with replacing(file) as fresh, fresh.open("wb") as stream:
        stream.write(data)
        stream.flush()
        os.fsync(stream.fileno())
