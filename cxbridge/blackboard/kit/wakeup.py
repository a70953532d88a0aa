"""A descriptor that wakes a thread out of a poll."""

from __future__ import annotations

import socket
import threading


class SocketWakeup:
    """Set by any thread, polled by one. Setting it many times wakes once."""

    __slots__ = ("_closed", "_lock", "_pending", "_reading", "_writing")

    def __init__(self) -> None:
        self._reading, self._writing = socket.socketpair()
        self._lock = threading.Lock()
        self._pending = self._closed = False

    def fileno(self) -> int:
        """Return the descriptor that becomes readable."""
        return self._reading.fileno()

    def set(self) -> None:
        """Make the descriptor readable; nothing once it is closed."""
        with self._lock:
            if not self._pending and not self._closed:
                self._pending = True
                self._writing.send(b"!")

    def clear(self) -> None:
        """Make the descriptor quiet; look for work afterwards."""
        if not self._pending:
            return
        with self._lock:
            if self._pending and not self._closed:
                self._pending = False
                self._reading.recv(16)

    def close(self) -> None:
        """Give the descriptors back; closing twice is not an error."""
        with self._lock:
            self._closed = True
            self._reading.close()
            self._writing.close()
