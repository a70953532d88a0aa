"""The file of a persistent embedded store: an SQLite database, whose changes are atomic.

The table ``documents`` has the collection, ``_id`` and extended JSON of each document; the ``rowid`` keeps
the insertion order. SQLite's exclusive lock permits one process at a time.
"""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from pathlib import Path
from typing import Any

from cxbridge_robot_memory.errors import RobotMemoryError
from cxbridge_robot_memory.jsontext import parse, to_text
from cxbridge_robot_memory.values import Document

_SCHEMA = """
CREATE TABLE IF NOT EXISTS documents (
  collection TEXT NOT NULL, id BLOB NOT NULL, document BLOB NOT NULL, UNIQUE (collection, id)
);
"""
_APPLICATION_ID = 0x43585242  # "CXRB", by which SQLite files of other programs are recognised
# the version of the tables and of the documents' encoding; files of other versions are refused
_LAYOUT_VERSION = 2


class DocumentFile:
    """The documents of an embedded store in a file.

    :raises RobotMemoryError: if the file is not a robot memory, or another process uses it.
    """

    def __init__(self, file: Path) -> None:
        self._file = file
        try:
            file.parent.mkdir(parents=True, exist_ok=True)
            # each statement is a transaction; the store's lock keeps threads apart; another process keeps its
            # lock until its end, so waiting for the lock is useless
            self._db = sqlite3.connect(file, isolation_level=None, check_same_thread=False, timeout=0)
        except (OSError, sqlite3.Error) as error:
            raise self._refusal_error(error) from None
        try:
            # with an exclusive lock from the first access, the write-ahead log needs no file of shared memory
            self._db.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._db.execute("PRAGMA journal_mode = WAL")
            # a change survives a crash of the process; after a power failure the file is consistent, but
            # perhaps not up to date
            self._db.execute("PRAGMA synchronous = NORMAL")
            self._refuse_foreign_file()
            self._db.executescript(
                f"BEGIN EXCLUSIVE; {_SCHEMA} PRAGMA application_id = {_APPLICATION_ID}; "
                f"PRAGMA user_version = {_LAYOUT_VERSION}; COMMIT;"
            )
        except sqlite3.Error as error:
            self._db.close()
            raise self._refusal_error(error) from None

    def _refuse_foreign_file(self) -> None:
        """Raise `RobotMemoryError` for a file of another program, or with another version of the layout."""
        (owner,) = self._db.execute("PRAGMA application_id").fetchone()
        (version,) = self._db.execute("PRAGMA user_version").fetchone()
        (table_count,) = self._db.execute("SELECT count(*) FROM sqlite_master").fetchone()
        if table_count and (owner, version) != (_APPLICATION_ID, _LAYOUT_VERSION):
            self._db.close()
            raise RobotMemoryError(
                "this database is not a robot memory of this version of cxbridge",
                file=self._file,
                hint="name another file",
            )

    def _refusal_error(self, error: Exception) -> RobotMemoryError:
        hint = "another process has the file open" if "locked" in str(error) else "name another file"
        return RobotMemoryError(f"cannot open the robot memory: {error}", file=self._file, hint=hint)

    def load_documents(self, add_document: Callable[[str, Document], object]) -> None:
        """Read the stored documents in insertion order. An error closes the file.

        :param add_document: called with the collection's name and each document; raises an error for a
            damaged document.
        :raises RobotMemoryError: if the file is damaged.
        """
        try:
            (result,) = self._db.execute("PRAGMA quick_check(1)").fetchone()
            if result != "ok":
                raise RobotMemoryError(result)  # noqa: TRY301 - gets the file and the hint below
            for collection, encoded_document in self._db.execute(
                "SELECT collection, document FROM documents ORDER BY rowid"
            ):
                add_document(collection, _decode(encoded_document))
        # the last three: a document without `_id`, or columns of wrong types
        except (sqlite3.Error, RobotMemoryError, UnicodeError, KeyError, TypeError, AttributeError) as error:
            self._db.close()
            raise RobotMemoryError(
                f"the robot memory in this file is damaged: {error}",
                file=self._file,
                hint="replace the file with a copy, or move the file away",
            ) from None

    def store_document(self, collection: str, document: Document) -> None:
        """Store or replace a document.

        :raises RobotMemoryError: if writing fails, e.g. on a full disk.
        """
        self._write(
            "INSERT INTO documents (collection, id, document) VALUES (?, ?, ?) "
            "ON CONFLICT (collection, id) DO UPDATE SET document = excluded.document",
            (collection, _encoded_id(document["_id"]), _encode(document)),
        )

    def delete_document(self, collection: str, identity: Any) -> None:
        """Delete a document.

        :raises RobotMemoryError: as in :meth:`store_document`.
        """
        self._write(
            "DELETE FROM documents WHERE collection = ? AND id = ?", (collection, _encoded_id(identity))
        )

    def _write(self, statement: str, parameters: tuple[object, ...]) -> None:
        try:
            self._db.execute(statement, parameters)
        except sqlite3.Error as error:
            raise RobotMemoryError(f"cannot write the robot memory: {error}", file=self._file) from None

    def close(self) -> None:
        """Close the file. Further calls do nothing."""
        self._db.close()


def _encoded_id(identity: Any) -> bytes:
    return _encode({"_id": identity})


def _encode(document: Document) -> bytes:
    # strings of CLIPS may contain bytes other than UTF-8, which are surrogates in Python
    return to_text(document).encode(errors="surrogatepass")


def _decode(encoded_document: bytes) -> Document:
    return parse(encoded_document.decode(errors="surrogatepass"))
