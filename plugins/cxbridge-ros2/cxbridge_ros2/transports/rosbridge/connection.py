"""The connection to a rosbridge: a websocket that reconnects automatically.

An operation is a message of the rosbridge protocol. A background thread receives operations and reconnects;
the thread puts operations into an inbox, which the node reads when it is polled. Any thread may send.
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

Operation = Mapping[str, Any]  # the JSON of an operation; the value of `op` is its kind

CONNECTION_LOST: Final = {"op": ""}  # stands in the inbox for the loss of the connection

_HANDSHAKE_TIMEOUT_S: Final = 5.0  # time limit of the WebSocket handshake
_RETRY_PERIOD_S: Final = 1.0  # time between two attempts to connect, or to add to a full inbox
_STOP_TIMEOUT_S: Final = 5.0  # time limit of the end of the thread
# Keys whose values must be texts or numbers, since the node looks the values up in dicts.
_NAME_KEYS: Final = ("op", "id", "topic", "service", "action")

# Limit of a message in bytes after decompression, enough for an image of 1920 x 1080 pixels. A larger message
# ends the connection, which is restored.
MAX_MESSAGE_BYTES: Final = 16 * 1024 * 1024

MAX_QUEUED_OPERATIONS: Final = 10_000  # limit of the inbox, for a node that is polled too rarely


class RosbridgeConnection:
    """A connection that repeats the registered operations after each reconnection.

    :ivar connection_count: the number of successful connections so far.
    :raises Ros2Error: if the URL is not that of a websocket, or no bridge answers.
    """

    def __init__(self, url: str) -> None:
        if not url.startswith(("ws://", "wss://")):
            raise Ros2Error(f"'{url}' is not a URL of a rosbridge", hint="e.g. ws://robot:9090")
        self._url = url
        self._inbox: queue.Queue[Operation] = queue.Queue(MAX_QUEUED_OPERATIONS)
        self._registered_operations: dict[int, Operation] = {}
        self._numbers = count()
        # guards `_registered_operations`, and the change of `_socket` to a new connection
        self._lock = threading.Lock()
        self._close_requested = threading.Event()
        self.connection_count = 0
        self._socket: ClientConnection | None = None
        self._open_resources = ExitStack()
        try:
            self._connect()
        except (OSError, WebSocketException, ValueError) as error:
            reason = str(error) or type(error).__name__
            raise Ros2Error(
                f"cannot connect to the rosbridge at {url}: {reason}",
                hint="is it running (ros2 launch rosbridge_server rosbridge_websocket_launch.xml), and is its"
                " port right?",
            ) from None
        self._thread = threading.Thread(target=self._keep_connected, name="rosbridge", daemon=True)
        self._thread.start()

    @property
    def is_connected(self) -> bool:
        return self._socket is not None

    def register(self, op: Operation, inverse_op: Operation) -> Callable[[], None]:
        """Send an operation now and after each reconnection.

        :returns: a function that ends the repetition and sends the inverse operation.
        """
        number = next(self._numbers)
        with self._lock:
            self._registered_operations[number] = op
        self.send(op)

        def unregister() -> None:
            with self._lock:
                self._registered_operations.pop(number, None)
            self.send(inverse_op)

        return unregister

    def send(self, op: Operation) -> bool:
        """Send an operation; return False without a connection."""
        socket = self._socket
        with suppress(WebSocketException, OSError):
            if socket is not None:
                socket.send(json.dumps(op))
                return True
        return False

    def receive(self, timeout_s: float) -> Iterator[Operation]:
        """Yield the operations in the inbox; wait for the first up to a time limit."""
        try:
            yield self._inbox.get(timeout=timeout_s) if timeout_s > 0 else self._inbox.get_nowait()
            while True:
                yield self._inbox.get_nowait()
        except queue.Empty:
            return

    def close(self) -> None:
        """Close the connection and end the thread."""
        self._close_requested.set()
        if self._socket is not None:
            self._socket.close()
        self._thread.join(_STOP_TIMEOUT_S)
        self._open_resources.close()

    def _connect(self) -> None:
        self._open_resources.close()  # releases the previous connection
        # without a proxy, since a proxy of the environment rarely reaches a robot
        socket: ClientConnection = self._open_resources.enter_context(
            connect(self._url, open_timeout=_HANDSHAKE_TIMEOUT_S, max_size=MAX_MESSAGE_BYTES, proxy=None)
        )
        # both under the lock: an operation that is registered later is sent to the new socket
        with self._lock:
            operations = list(self._registered_operations.values())
            self._socket = socket
        self.connection_count += 1
        for op in operations:
            self.send(op)

    def _keep_connected(self) -> None:
        while not self._close_requested.is_set():
            socket = self._socket
            if socket is not None:
                self._receive_operations(socket)
                self._socket = None
                self._put_in_inbox(CONNECTION_LOST)  # the node fails the pending calls in its thread
            elif not self._close_requested.wait(_RETRY_PERIOD_S):
                try:
                    self._connect()
                except (OSError, WebSocketException, ValueError):
                    continue  # the bridge may be restarting: try again after the period

    def _put_in_inbox(self, op: Operation) -> None:
        """Add an operation to the inbox. If the inbox is full, the bridge waits until the node is polled."""
        while not self._close_requested.is_set():
            with suppress(queue.Full):
                self._inbox.put(op, timeout=_RETRY_PERIOD_S)
                return

    def _receive_operations(self, socket: ClientConnection) -> None:
        try:
            for websocket_message in socket:
                op = _parse_operation(websocket_message)
                if op is not None:
                    self._put_in_inbox(op)
        except (WebSocketException, OSError):
            return  # the connection was lost, or closed by this side


def _parse_operation(websocket_message: str | bytes) -> Operation | None:
    """Parse an operation; return None for invalid data, which is ignored."""
    try:
        op = json.loads(websocket_message)
    except (ValueError, RecursionError):
        return None
    is_operation = isinstance(op, dict) and all(isinstance(op.get(key, ""), str | int) for key in _NAME_KEYS)
    return op if is_operation else None
