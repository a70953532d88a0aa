"""A pipe that wakes a thread out of a poll."""

from __future__ import annotations

import os
import sys
import threading

from cxbridge.blackboard.zmq.errors import EndpointError


def _pipe() -> tuple[int, int]:
    if sys.platform == "win32":
        raise EndpointError(
            "blackboards over ZeroMQ need pipes that can be polled, which Windows lacks",
            hint="use WSL, or fawkes:// URLs; a daemon does without them by zmq/endpoints: []",
        )
    ends = os.pipe()
    for end in ends:
        os.set_blocking(end, False)
    return ends


class Wakeup:
    """Set by any thread, polled by one. Setting it many times wakes once."""

    __slots__ = ("_lock", "_pending", "_writing", "fd")

    def __init__(self) -> None:
        self.fd, self._writing = _pipe()
        self._lock = threading.Lock()
        self._pending = False

    def set(self) -> None:
        """Make :attr:`fd` readable; nothing once it is closed."""
        with self._lock:
            if not self._pending and self._writing >= 0:
                self._pending = True
                os.write(self._writing, b"!")

    def clear(self) -> None:
        """Make :attr:`fd` quiet; look at what there is to do afterwards."""
        if not self._pending:
            return
        with self._lock:
            if self._pending:
                self._pending = False
                os.read(self.fd, 16)

    def close(self) -> None:
        """Give the descriptors back; closing twice is no error."""
        with self._lock:
            if self._writing >= 0:
                os.close(self.fd)
                os.close(self._writing)
                self.fd = self._writing = -1
