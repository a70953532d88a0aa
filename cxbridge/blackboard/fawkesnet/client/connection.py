"""The TCP connection of a client to a Fawkes: sends frames, receives them in a thread.

Any thread sends, one at a time, by a lock; the receiving thread alone reads, and ends with the connection.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Final

from cxbridge.blackboard.fawkesnet.errors import ConnectionLostError, UnreachableError
from cxbridge.blackboard.fawkesnet.messages.codec import limit_to_client
from cxbridge.blackboard.fawkesnet.messages.frames import FawkesFrame, FrameDecoder
from cxbridge.blackboard.fawkesnet.sockets import acknowledge, tune
from cxbridge.blackboard.kit.errors import ProtocolError

_CHUNK: Final = 256 * 1024


class FawkesConnection:
    """One connection, from being made to being lost; it is never made again.

    :param address: host and port.
    :param timeout: seconds to connect, and for the other end to take a frame.
    :param on_frame: called with each frame, in the receiving thread.
    :param on_lost: called once with the reason when the connection ends, in the receiving thread.
    :raises UnreachableError: when no server answers.
    """

    def __init__(
        self,
        address: tuple[str, int],
        timeout: float,
        on_frame: Callable[[FawkesFrame], None],
        on_lost: Callable[[FawkesConnection, str], None],
    ) -> None:
        self.address: Final = f"{address[0]}:{address[1]}"
        self._on_frame: Final = on_frame
        self._on_lost: Final = on_lost
        self.last_received_s = time.monotonic()
        """When something came from the other end, by the monotonic clock."""
        self._sending = threading.Lock()
        self._reason = ""
        try:
            self._sock = socket.create_connection(address, timeout)
        except OSError as error:
            raise UnreachableError(self.address, error.strerror or str(error)) from None
        if self._sock.getsockname() == self._sock.getpeername():  # TCP does that without a listener
            self._sock.close()
            raise UnreachableError(self.address, "connected to itself")
        tune(self._sock)
        self._sock.settimeout(None)
        seconds, fraction = divmod(timeout, 1)
        self._sock.setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("@ll", int(seconds), int(fraction * 1e6))
        )
        self._thread = threading.Thread(target=self._receive, name="FawkesNetReceiver", daemon=True)

    @property
    def ended(self) -> bool:
        """Whether it is at its end, even if that has not been reported yet."""
        return bool(self._reason)

    def start(self) -> None:
        """Begin to receive."""
        self._thread.start()

    def send(self, data: bytes) -> None:
        """Send whole frames.

        :raises ConnectionLostError: when the connection is lost, or the other end takes nothing any more.
        """
        with self._sending:
            if self._reason:
                raise ConnectionLostError(self.address, self._reason)
            try:
                self._sock.sendall(data)
            except OSError as error:
                # part of a frame may be out: nothing that follows would be understood
                blocked = isinstance(error, BlockingIOError)
                self._reason = "the other end takes nothing any more" if blocked else str(error)
                self._cut()
                raise ConnectionLostError(self.address, self._reason) from None

    def abort(self, reason: str) -> None:
        """End the connection, from whichever thread."""
        self._reason = self._reason or reason
        self._cut()

    def finish(self, timeout: float) -> None:
        """End the connection after all that was sent, and wait for the receiving thread."""
        with contextlib.suppress(OSError):
            self._sock.shutdown(socket.SHUT_WR)
        self._reason = self._reason or "it was closed"
        if self._thread is not threading.current_thread() and self._thread.is_alive():
            self._thread.join(min(timeout, 0.5))  # the other end closes when it has read everything
            self._cut()
            self._thread.join(timeout)
        self._sock.close()

    def _cut(self) -> None:
        with contextlib.suppress(OSError):
            self._sock.shutdown(socket.SHUT_RDWR)

    def _receive(self) -> None:
        decoder = FrameDecoder(limit_to_client)
        reason = "it was closed by the other end"
        try:
            while data := self._sock.recv(_CHUNK):
                acknowledge(self._sock)
                self.last_received_s = time.monotonic()
                for frame in decoder.feed(data):
                    self._on_frame(frame)
        except OSError as error:
            reason = error.strerror or str(error)
        except ProtocolError as error:
            reason = error.message
        self._reason = self._reason or reason
        self._cut()
        self._on_lost(self, self._reason)
        self._sock.close()
