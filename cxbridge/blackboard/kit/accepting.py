"""Listening sockets for when the process has no file descriptors left: they pause, and say so once a minute.

A connection that cannot be accepted stays in the kernel's queue and keeps the listening socket readable: who
tries again at once does nothing else, and logs each time. After a pause there may be descriptors again.
"""

from __future__ import annotations

import asyncio
import errno
import socket
import time
from collections.abc import Callable
from typing import Any, Final, Self

from cxbridge.blackboard.kit.complaints import Complaints

PAUSE_S: Final = 1.0
"""Seconds without an accept after a failed one."""

_EXHAUSTED: Final = frozenset({errno.EMFILE, errno.ENFILE, errno.ENOBUFS, errno.ENOMEM})


def is_exhausted(error: BaseException | None) -> bool:
    """Whether the process, or the machine, has no descriptors or memory left for another socket."""
    return isinstance(error, OSError) and error.errno in _EXHAUSTED


class Shortage:
    """Reports that connections cannot be accepted, once a minute with the number of failures. Thread-safe.

    :param log: takes the text.
    :param where: what cannot accept.
    """

    def __init__(self, log: Callable[[str], None], where: str = "connections") -> None:
        self._complaints: Final = Complaints(log)
        self._where: Final = where

    def report(self, reason: str) -> None:
        """Report it, unless it was reported a moment ago."""
        text = f"cannot accept {self._where}: {reason}; they wait until there is room"
        self._complaints.add("", text)


class PatientListener(socket.socket):
    """A listening socket for asyncio, of which some versions try again at once, a thousand times."""

    _again_s: float = 0.0

    @classmethod
    def of(cls, listening: socket.socket) -> Self:
        """Return a socket that listens in the place of another one."""
        return cls(listening.family, listening.type, listening.proto, fileno=listening.detach())

    def accept(self) -> tuple[socket.socket, Any]:
        """Take a connection.

        :raises OSError: when there is none, or no descriptor for it; then accepting pauses for a while.
        """
        if time.monotonic() < self._again_s:
            raise BlockingIOError
        try:
            return super().accept()
        except OSError as error:
            if is_exhausted(error):
                # asyncio lets the socket rest for a second then, but has not always ended its loop
                self._again_s = time.monotonic() + PAUSE_S / 2
            raise


def heed_shortage(loop: asyncio.AbstractEventLoop, shortage: Shortage) -> None:
    """Let a loop report a shortage in one line, in place of a traceback each time."""

    def handle(loop: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if isinstance(error, OSError) and is_exhausted(error):
            shortage.report(error.strerror or str(error))
        elif not _is_of_a_closed_socket(context):
            loop.default_exception_handler(context)

    loop.set_exception_handler(handle)


def _is_of_a_closed_socket(context: dict[str, Any]) -> bool:
    """Whether a loop wants to continue to accept by a socket that was closed during the pause."""
    return isinstance(context.get("exception"), ValueError) and "_start_serving" in context["message"]
