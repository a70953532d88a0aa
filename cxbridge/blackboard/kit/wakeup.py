"""A file descriptor that wakes a thread from its poll."""

from __future__ import annotations

import socket
import threading


class SocketWakeup:
    """A wake-up that any thread sets and one thread polls."""

    __slots__ = ("_is_closed", "_is_set", "_lock", "_receiver", "_sender")

    def __init__(self) -> None:
        self._receiver, self._sender = socket.socketpair()
        self._lock = threading.Lock()
        self._is_set = self._is_closed = False

    def fileno(self) -> int:
        """Return the descriptor to poll for reading."""
        return self._receiver.fileno()

    def set(self) -> None:
        """Make the descriptor readable; without effect after `close`."""
        # at most one pending byte, because a full socket would block the caller
        with self._lock:
            if not self._is_set and not self._is_closed:
                self._is_set = True
                self._sender.send(b"!")

    def clear(self) -> None:
        """Make the descriptor unreadable.

        The caller clears first and looks for work afterwards, so that work of a later `set` is not missed.
        """
        if not self._is_set:  # the usual case, tested without the cost of the lock
            return
        with self._lock:
            if self._is_set and not self._is_closed:
                self._is_set = False
                self._receiver.recv(1)

    def close(self) -> None:
        """Close the descriptors; further calls do nothing."""
        with self._lock:
            self._is_closed = True
            self._receiver.close()
            self._sender.close()
