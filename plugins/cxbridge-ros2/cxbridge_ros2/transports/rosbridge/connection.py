"""The connection to a rosbridge: a websocket that reconnects automatically.

A thread owns the receiving side and the reconnection: it puts operations into an inbox, which the node reads
when it is polled. Any thread may send.
"""

from __future__ import annotations

import json
import queue
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from itertools import count
from typing import Any, Final

from websockets.exceptions import WebSocketException
from websockets.sync.client import ClientConnection, connect

from cxbridge.errors import Ros2Error

Operation = Mapping[str, Any]  # a message of the rosbridge protocol; `op` is its operation

LOST: Final = {"op": ""}  # placeholder in the inbox for a lost connection

_OPEN_S: Final = 5.0  # seconds for the WebSocket handshake
_RETRY_S: Final = 1.0  # seconds between two attempts to connect
_STOP_S: Final = 5.0  # seconds for the thread to end
_KEYS: Final = ("op", "id", "topic", "service", "action")  # keys of operations that are read as names

# Limit of an unpacked message in bytes. A larger one resets the connection.
MAX_BYTES: Final = 16 * 1024 * 1024

MAX_QUEUED: Final = 10_000  # limit of queued operations


class RosbridgeConnection:
    """A connection that repeats the registered operations after each reconnection."""

    def __init__(self, url: str) -> None:
        if not url.startswith(("ws://", "wss://")):
            raise Ros2Error(f"'{url}' is no URL of a rosbridge", hint="e.g. ws://robot:9090")
        self._url = url
        self._inbox: queue.Queue[Operation] = queue.Queue(MAX_QUEUED)
        self._registered: dict[int, Operation] = {}
        self._numbers = count()
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self.connections = 0  # number of connections so far
        self._socket: ClientConnection | None = None
        self._open = ExitStack()
        try:
            self._connect()
        except (OSError, WebSocketException, ValueError) as error:
            reason = str(error) or type(error).__name__
            raise Ros2Error(
                f"cannot connect to the rosbridge at {url}: {reason}",
                hint="is it running (ros2 launch rosbridge_server rosbridge_websocket_launch.xml), and is its"
                " port right?",
            ) from None
        self._thread = threading.Thread(target=self._run, name="rosbridge", daemon=True)
        self._thread.start()

    @property
    def is_up(self) -> bool:
        return self._socket is not None

    def register(self, op: Operation, undo: Operation) -> Callable[[], None]:
        """Send an operation now and after each reconnection; return the function that undoes it."""
        number = next(self._numbers)
        with self._lock:
            self._registered[number] = op
        self.send(op)

        def end() -> None:
            with self._lock:
                self._registered.pop(number, None)
            self.send(undo)

        return end

    def send(self, op: Operation) -> bool:
        socket = self._socket
        if socket is None:
            return False
        try:
            socket.send(json.dumps(op))
        except (WebSocketException, OSError):
            return False
        return True

    def receive(self, timeout_s: float) -> Iterator[Operation]:
        try:
            yield self._inbox.get(timeout=timeout_s) if timeout_s > 0 else self._inbox.get_nowait()
            while True:
                yield self._inbox.get_nowait()
        except queue.Empty:
            return

    def close(self) -> None:
        """Close the connection and end the thread."""
        self._closing.set()
        if self._socket is not None:
            self._socket.close()
        self._thread.join(_STOP_S)
        self._open.close()

    def _connect(self) -> None:
        self._open.close()  # releases the previous connection
        socket: ClientConnection = self._open.enter_context(
            connect(self._url, open_timeout=_OPEN_S, max_size=MAX_BYTES, proxy=None)
        )
        with self._lock:
            operations = list(self._registered.values())
        self._socket = socket
        self.connections += 1
        for op in operations:
            self.send(op)

    def _run(self) -> None:
        while not self._closing.is_set():
            socket = self._socket
            if socket is not None:
                self._receive(socket)
                self._socket = None
                self._put_in_inbox(LOST)  # pending calls fail, in the thread of the node
            elif not self._closing.wait(_RETRY_S):
                try:
                    self._connect()
                except (OSError, WebSocketException, ValueError):
                    continue

    def _put_in_inbox(self, op: Operation) -> None:
        """Add an operation to the inbox. A full inbox makes the bridge wait."""
        while not self._closing.is_set():
            with suppress(queue.Full):
                self._inbox.put(op, timeout=_RETRY_S)
                return

    def _receive(self, socket: ClientConnection) -> None:
        try:
            for text in socket:
                op = _parse(text)
                if op is not None:
                    self._put_in_inbox(op)
        except (WebSocketException, OSError):
            return


def _parse(text: str | bytes) -> Operation | None:
    """Return an operation, or None for invalid data."""
    try:
        op = json.loads(text)
    except (ValueError, RecursionError):
        return None
    is_operation = isinstance(op, dict) and all(isinstance(op.get(key, ""), str | int) for key in _KEYS)
    return op if is_operation else None
