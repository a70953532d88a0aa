"""A server with MongoDB's wire protocol on the embedded store; a driver sees a replica set.

The server tests the client's protocol: commands, cursors, change streams, errors, and outages. Queries use
the embedded store, so only a real mongod can test MongoDB's semantics (``CXBRIDGE_TEST_MONGODB``).
"""

from __future__ import annotations

import contextlib
import socketserver
import struct
import threading
import time
from datetime import UTC, datetime
from typing import Any, Self

import bson

from cxbridge.clock import RealClock
from cxbridge_robot_memory.embedded import EmbeddedStore
from cxbridge_robot_memory.errors import DuplicateKeyError, QueryError
from cxbridge_robot_memory.mongodb.bsonvalues import CODEC, from_bson, to_bson

Document = dict[str, Any]

_OP_MSG = 2013
_OP_QUERY = 2004
_OP_REPLY = 1
_HEADER = struct.Struct("<iiii")


class _Stream:
    """A change stream: a cursor that waits for events."""

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self.events: list[Document] = []

    def add(self, event: Document) -> None:
        with self._changed:
            self.events.append(event)
            self._changed.notify_all()

    def wait(self, milliseconds: int) -> list[Document]:
        with self._changed:
            self._changed.wait_for(lambda: bool(self.events), milliseconds / 1000)
            events, self.events = self.events, []
            return events


class MongoServer:
    """A context manager of the server.

    :param port: 0 for a free port.
    :param before: a stopped server, whose documents the new server takes over.
    """

    def __init__(self, port: int = 0, before: MongoServer | None = None) -> None:
        self.store: EmbeddedStore = before.store if before else EmbeddedStore(RealClock())
        self._history: dict[str, list[Document]] = before._history if before else {}
        self.indexes: list[Document] = []
        self._streams: dict[int, _Stream] = {}
        self._lock = threading.RLock()
        self._connections: set[Any] = set()
        server = self

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                server._connections.add(self.request)
                with contextlib.suppress(OSError, struct.error, EOFError):
                    server._serve(self.request)
                server._connections.discard(self.request)

        class Server(socketserver.ThreadingTCPServer):
            allow_reuse_address = True
            daemon_threads = True

        self._server = Server(("127.0.0.1", port), Handler)
        self.port: int = self._server.server_address[1]
        self.uri = f"mongodb://127.0.0.1:{self.port}/?replicaSet=test"
        self._thread = threading.Thread(target=self._server.serve_forever, kwargs={"poll_interval": 0.02})
        self._thread.start()

    def stop(self) -> None:
        """Stop as a crashed server."""
        self._server.shutdown()
        self._server.server_close()
        for connection in tuple(self._connections):
            with contextlib.suppress(OSError):
                connection.shutdown(2)
        self._thread.join()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    # --- the wire -------------------------------------------------------------------------------------------

    def _serve(self, connection: Any) -> None:
        stream = connection.makefile("rb")
        while True:
            head = stream.read(_HEADER.size)
            if len(head) < _HEADER.size:
                return
            length, request, _, code = _HEADER.unpack(head)
            body = stream.read(length - _HEADER.size)
            if code == _OP_MSG:
                (flags,) = struct.unpack_from("<I", body)
                reply = self._answer(_read_sections(body))
                if not flags & 2:
                    self._send(
                        connection, request, _OP_MSG, struct.pack("<IB", 0, 0) + bson.encode(to_bson(reply))
                    )
            elif code == _OP_QUERY:
                data = struct.pack("<iqii", 8, 0, 0, 1) + bson.encode(self._hello())
                self._send(connection, request, _OP_REPLY, data)

    @staticmethod
    def _send(connection: Any, request: int, code: int, data: bytes) -> None:
        connection.sendall(_HEADER.pack(_HEADER.size + len(data), 1, request, code) + data)

    def _answer(self, command: Document) -> Document:
        name = next(iter(command))
        run = getattr(self, f"do_{name.lower()}", None)
        if run is None:
            return {"ok": 0.0, "errmsg": f"no such command: '{name}'", "code": 59}
        try:
            return {"ok": 1.0, **run(command)}
        except DuplicateKeyError as error:
            return {"ok": 0.0, "errmsg": f"E11000 {error}", "code": 11000, "codeName": "DuplicateKey"}
        except QueryError as error:
            return {"ok": 0.0, "errmsg": str(error), "code": 2, "codeName": "BadValue"}

    # --- commands -------------------------------------------------------------------------------------------

    def _hello(self) -> Document:
        me = f"127.0.0.1:{self.port}"
        return {
            "ok": 1.0,
            "helloOk": True,
            "ismaster": True,
            "isWritablePrimary": True,
            "setName": "test",
            "setVersion": 1,
            "hosts": [me],
            "primary": me,
            "me": me,
            "maxBsonObjectSize": 16_777_216,
            "maxMessageSizeBytes": 48_000_000,
            "maxWriteBatchSize": 100_000,
            "localTime": datetime.now(UTC),
            "minWireVersion": 0,
            "maxWireVersion": 21,
        }

    def do_hello(self, command: Document) -> Document:
        if command.get("maxAwaitTimeMS"):
            time.sleep(min(command["maxAwaitTimeMS"], 50) / 1000)
        return self._hello()

    do_ismaster = do_hello

    def do_ping(self, _command: Document) -> Document:
        return {}

    do_endsessions = do_ping

    def do_insert(self, command: Document) -> Document:
        return self._write(command, command["documents"], self.store.insert)

    def do_update(self, command: Document) -> Document:
        upserted = []

        def update(name: str, change: Document) -> int:
            known = len(self.store.find(name))
            matched = self.store.update(name, change["q"], change["u"], upsert=change.get("upsert", False))
            if len(self.store.find(name)) > known:
                upserted.append({"index": 0, "_id": self.store.find(name)[-1]["_id"]})
            return matched

        result = self._write(command, command["updates"], update)
        return {**result, "nModified": result["n"], **({"upserted": upserted} if upserted else {})}

    def do_delete(self, command: Document) -> Document:
        return self._write(
            command, command["deletes"], lambda name, delete: self.store.remove(name, delete["q"])
        )

    def _write(self, command: Document, parts: list[Document], write: Any) -> Document:
        name = self._name(command)
        self._record(name)
        done = 0
        for index, part in enumerate(parts):
            try:
                result = write(name, part)
            except (DuplicateKeyError, QueryError) as error:
                code = 11000 if isinstance(error, DuplicateKeyError) else 2
                return {"n": done, "writeErrors": [{"index": index, "code": code, "errmsg": str(error)}]}
            done += result if type(result) is int and "insert" not in command else 1
        return {"n": done}

    def do_findandmodify(self, command: Document) -> Document:
        name = self._name(command)
        self._record(name)
        found = self.store.find_one_and_update(
            name, command["query"], command["update"], upsert=command.get("upsert", False)
        )
        return {"value": found}

    def do_find(self, command: Document) -> Document:
        name = self._name(command)
        found = self.store.find(name, command.get("filter"), sort=command.get("sort"))
        return _batch(name, found)

    def do_aggregate(self, command: Document) -> Document:
        name, pipeline = self._name(command), command["pipeline"]
        return self._watch(name, pipeline)

    def _watch(self, name: str, pipeline: list[Document]) -> Document:
        query = pipeline[1]["$match"] if len(pipeline) > 1 else {}
        stage = pipeline[0]["$changeStream"]
        token = stage.get("startAfter") or stage.get("resumeAfter")
        stream = _Stream()
        with self._lock:
            self._record(name)
            if token is not None and "_data" in token and token["_data"] != "begin":
                for event in self._history[name]:
                    if event["_id"]["_data"] > token["_data"]:
                        stream.add(event)
            self.store.watch(name, query, stream.add)
            number = len(self._streams) + 1000
            self._streams[number] = stream
            last = self._history[name][-1]["_id"] if self._history[name] else {"_data": "begin"}
        reply = _batch(name, [], number)
        reply["cursor"]["postBatchResumeToken"] = token or last
        return reply

    def _record(self, name: str) -> None:
        """Record the events of a collection from now on, as the oplog does."""
        with self._lock:
            if name not in self._history:
                self._history[name] = []
                self.store.watch(name, {}, self._history[name].append)

    def do_getmore(self, command: Document) -> Document:
        name = f"{command['$db']}.{command['collection']}"
        events = self._streams[command["getMore"]].wait(command.get("maxTimeMS", 100))
        cursor: Document = {"id": command["getMore"], "ns": name, "nextBatch": events}
        if events:
            cursor["postBatchResumeToken"] = events[-1]["_id"]
        return {"cursor": cursor}

    def do_killcursors(self, command: Document) -> Document:
        for number in command["cursors"]:
            self._streams.pop(number, None)
        return {"cursorsKilled": command["cursors"]}

    def do_createindexes(self, command: Document) -> Document:
        self.indexes += command["indexes"]
        return {}

    @staticmethod
    def _name(command: Document) -> str:
        return f"{command['$db']}.{next(iter(command.values()))}"


def _batch(name: str, documents: list[Document], number: int = 0) -> Document:
    return {"cursor": {"id": bson.Int64(number), "ns": name, "firstBatch": documents}}


def _read_sections(body: bytes) -> Document:
    """Return the command of an OP_MSG, with the documents of its sequences in place."""
    command: Document = {}
    at = 4
    while at < len(body):
        kind, at = body[at], at + 1
        (size,) = struct.unpack_from("<i", body, at)
        if kind == 0:
            command = {**from_bson(bson.decode(body[at : at + size], CODEC)), **command}
        else:
            end = body.index(0, at + 4)
            name, documents, place = body[at + 4 : end].decode(), [], end + 1
            while place < at + size:
                (length,) = struct.unpack_from("<i", body, place)
                documents.append(from_bson(bson.decode(body[place : place + length], CODEC)))
                place += length
            command[name] = documents
        at += size
    return command
