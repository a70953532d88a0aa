"""Listening sockets that pause accepting while the process has no file descriptors left.

A connection that cannot be accepted stays in the kernel's queue and keeps the socket readable. Accepting
again at once would therefore loop and log without end.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import time
from collections.abc import Callable
from typing import Any, Final, Self

from cxbridge.blackboard.kit.complaints import Complaints

# long enough for connections to end and free their descriptors
PAUSE_S: Final = 1.0

_EXHAUSTED: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})


def is_exhausted(error: BaseException | None) -> bool:
    """Return whether the error means that no descriptors or memory are left for a socket."""
    return isinstance(error, OSError) and error.errno in _EXHAUSTED


class Shortage:
    """Logs that connections cannot be accepted, at most once a minute. Thread-safe.

    :param where: the kind of connections, for the log line.
    """

    def __init__(self, log: Callable[[str], None], where: str = "connections") -> None:
        self._complaints: Final = Complaints(log)
        self._where: Final = where

    def report(self, reason: str) -> None:
        text = f"cannot accept {self._where}: {reason}; they wait until there is room"
        self._complaints.add("", text)


class PatientListener(socket.socket):
    """A listening socket for asyncio that pauses accepting after a shortage.

    Some versions of asyncio try again at once, a thousand times.
    """

    _again_s: float = 0.0

    @classmethod
    def of(cls, listening: socket.socket) -> Self:
        """Take over the descriptor of a listening socket."""
        return cls(listening.family, listening.type, listening.proto, fileno=listening.detach())

    def accept(self) -> tuple[socket.socket, Any]:
        """Accept a connection.

        :raises OSError: if there is no connection, or no descriptor for it.
        """
        if time.monotonic() < self._again_s:
            raise BlockingIOError
        try:
            return super().accept()
        except OSError as error:
            if is_exhausted(error):
                # some versions of asyncio pause for a second themselves, but finish their accept loop first
                self._again_s = time.monotonic() + PAUSE_S / 2
            raise


def heed_shortage(loop: asyncio.AbstractEventLoop, shortage: Shortage) -> None:
    """Make a loop report a shortage in one line instead of a traceback each time."""

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if isinstance(error, OSError) and is_exhausted(error):
            shortage.report(error.strerror or str(error))
        elif not _is_of_a_closed_socket(context):
            loop.default_exception_handler(context)

    loop.set_exception_handler(handle)


def _is_of_a_closed_socket(context: dict[str, Any]) -> bool:
    """Return whether asyncio tried to accept on a socket that was closed during its pause."""
    return isinstance(context.get("exception"), ValueError) and "_start_serving" in context["message"]
