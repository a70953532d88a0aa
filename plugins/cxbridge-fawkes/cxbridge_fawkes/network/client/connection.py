"""A client's TCP connection to Fawkes.

Any thread may send, under a lock. Only the receiving thread reads.
"""

from __future__ import annotations

import contextlib
import socket
import struct
import threading
import time
from collections.abc import Callable
from typing import Final

from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge_fawkes.network.errors import ConnectionLostError, UnreachableError
from cxbridge_fawkes.network.messages.codec import client_payload_limit
from cxbridge_fawkes.network.messages.frames import FawkesFrame, FrameDecoder
from cxbridge_fawkes.network.sockets import acknowledge_at_once, configure_socket

_READ_BYTES: Final = 256 * 1024  # the maximal size of one read, chosen freely


class FawkesConnection:
    """One connection; after its end, the client makes a new object.

    :param endpoint: host and port.
    :param timeout: seconds for connecting, and for the server to accept a frame.
    :param on_frame: called with each frame in the receiving thread.
    :param on_lost: called once at the end, with the connection and the reason, in the receiving thread.
    :raises UnreachableError: if no server accepts the connection.
    """

    def __init__(
        self,
        endpoint: tuple[str, int],
        timeout: float,
        on_frame: Callable[[FawkesFrame], None],
        on_lost: Callable[[FawkesConnection, str], None],
    ) -> None:
        self.address: Final = f"{endpoint[0]}:{endpoint[1]}"
        self._on_frame: Final = on_frame
        self._on_lost: Final = on_lost
        self.last_received_s = time.monotonic()
        """The time of the last received data, by the monotonic clock."""
        self._send_lock = threading.Lock()
        self._end_reason = ""
        try:
            self._sock = socket.create_connection(endpoint, timeout)
        except OSError as error:
            raise UnreachableError(self.address, error.strerror or str(error)) from None
        # if no server listens on the port, TCP may choose it as the client's own and connect the socket to
        # itself
        if self._sock.getsockname() == self._sock.getpeername():
            self._sock.close()
            raise UnreachableError(self.address, "connected to itself")
        configure_socket(self._sock)
        self._sock.settimeout(None)
        # only sending has a timeout: settimeout() would limit receiving, too
        seconds, fraction = divmod(timeout, 1)  # of the C struct timeval
        self._sock.setsockopt(
            socket.SOL_SOCKET, socket.SO_SNDTIMEO, struct.pack("@ll", int(seconds), int(fraction * 1e6))
        )
        self._thread = threading.Thread(target=self._receive, name="FawkesNetReceiver", daemon=True)

    @property
    def has_ended(self) -> bool:
        """Whether the connection has ended, even if ``on_lost`` was not called yet."""
        return bool(self._end_reason)

    def start(self) -> None:
        """Start the receiving thread."""
        self._thread.start()

    def send(self, frames: bytes) -> None:
        """Send complete frames.

        :raises ConnectionLostError: if the connection is lost or the server accepts no data.
        """
        with self._send_lock:
            if self._end_reason:
                raise ConnectionLostError(self.address, self._end_reason)
            try:
                self._sock.sendall(frames)
            except OSError as error:
                # a part of the frame may have been sent, after which the server would misread further frames
                self._end_reason = str(error)
                if isinstance(error, BlockingIOError):  # the timeout of the socket option SO_SNDTIMEO
                    self._end_reason = "the other end does not accept data any more"
                self._disconnect()
                raise ConnectionLostError(self.address, self._end_reason) from None

    def abort(self, reason: str) -> None:
        """End the connection. Only the first reason counts. Callable from any thread."""
        self._end_reason = self._end_reason or reason
        self._disconnect()

    def close_after_sending(self, timeout: float) -> None:
        """End the connection after all sent data, and wait for the receiving thread."""
        with contextlib.suppress(OSError):  # the peer may have closed the connection first
            self._sock.shutdown(socket.SHUT_WR)
        self._end_reason = self._end_reason or "it was closed"
        if self._thread is not threading.current_thread() and self._thread.is_alive():
            # a server closes the connection after it has read everything, within half a second if it is alive
            self._thread.join(min(timeout, 0.5))
            self._disconnect()
            self._thread.join(timeout)
        self._sock.close()

    def _disconnect(self) -> None:
        with contextlib.suppress(OSError):  # the connection may be closed already
            self._sock.shutdown(socket.SHUT_RDWR)

    def _receive(self) -> None:
        decoder = FrameDecoder(client_payload_limit)
        reason = "it was closed by the other end"
        try:
            while chunk := self._sock.recv(_READ_BYTES):
                acknowledge_at_once(self._sock)
                self.last_received_s = time.monotonic()
                for frame in decoder.feed(chunk):
                    self._on_frame(frame)
        except OSError as error:
            reason = error.strerror or str(error)
        except ProtocolError as error:
            reason = error.message
        self._end_reason = self._end_reason or reason
        self._disconnect()
        self._on_lost(self, self._end_reason)
        self._sock.close()
