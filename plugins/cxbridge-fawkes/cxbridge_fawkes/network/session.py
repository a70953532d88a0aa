"""A session of the server: a client's connection, limits and queued frames.

A blackboard calls listeners in the thread of the writer, which must not wait for a slow client. So a session
sends as many bytes as the socket accepts, and queues the rest for the server's thread.
"""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from abc import ABC, abstractmethod
from typing import ClassVar, Final, Protocol

from cxbridge_fawkes.network.messages.codec import server_payload_limit
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame, FrameDecoder
from cxbridge_fawkes.network.outbox import MAX_QUEUED_BYTES, Outbox


class FawkesNetworkHub(Protocol):
    """The server's interface for sessions and components."""

    def request_flush(self, session: FawkesSession) -> None:
        """Flush or drop a session soon, in the server's thread."""

    def defer_flush(self, session: FawkesSession) -> bool:
        """Defer the flush of a session to the end of the round.

        :returns: False without effect, if the caller is not the server's thread in a round.
        """

    def broadcast(self, frames: bytes) -> None:
        """Send frames to all clients."""


class FawkesSession:
    """One client. Any thread may send, without blocking.

    :param number: identifies the client in the server and its log lines; counted from 1.
    :param sock: a connected, non-blocking socket.
    :param peer: the client's address, for log lines.
    :param hub: the server.
    """

    def __init__(self, number: int, sock: socket.socket, peer: str, hub: FawkesNetworkHub) -> None:
        self.number: Final = number
        self.sock: Final = sock
        self.peer: Final = peer
        self.max_block_size = 0
        """The size of the largest block that the client may send now."""
        self.decoder: Final = FrameDecoder(
            lambda component, kind: server_payload_limit(component, kind, self.max_block_size)
        )
        self.awaits_writable = False
        """Whether the server polls the socket for room for the queued frames."""
        self._hub: Final = hub
        self._outbox = Outbox()
        self._lock = threading.Lock()
        self._last_progress_s = time.monotonic()
        self.drop_reason = ""
        """The reason why the server must drop the session; else empty."""
        self.send_failed = False
        """Whether sending has failed; received data may still be readable."""

    def __repr__(self) -> str:
        return f"client {self.number} ({self.peer})"

    def request_drop(self, reason: str) -> None:
        """Make the server's thread drop the session. Only the first reason counts."""
        self.drop_reason = self.drop_reason or reason
        self._hub.request_flush(self)

    def send(self, frames: bytes) -> None:
        """Send complete frames, or queue them for a slow client. Never blocks or fails."""
        with self._lock:
            self._outbox.put_frames(frames)
            self._flush_unless_deferred()

    def send_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        """Send the data of an instance, which may replace older queued data of the instance.

        :param serial: 16 bytes.
        """
        with self._lock:
            self._outbox.put_data(serial, block, changed=changed)
            self._flush_unless_deferred()

    def flush(self) -> bool:
        """Send as many queued bytes as the socket accepts; return :attr:`awaits_writable`."""
        with self._lock:
            self._send_queued()
            self.awaits_writable = bool(self._outbox)
            return self.awaits_writable

    def stalled_s(self, now_s: float) -> float:
        """Return the seconds for which the client has not accepted queued bytes."""
        return now_s - self._last_progress_s if self._outbox else 0.0

    def close(self) -> None:
        """End the connection, after sending as many queued bytes as the socket accepts.

        A session with a drop reason sends nothing.
        """
        if not self.drop_reason:
            self.flush()
        self.drop_reason = self.drop_reason or "closed"
        with self._lock:  # no other thread may send to a new socket with the same file descriptor
            with contextlib.suppress(OSError):  # the connection may have ended already
                self.sock.shutdown(socket.SHUT_RDWR)
            self.sock.close()

    def _flush_unless_deferred(self) -> None:
        """Send queued bytes unless the server's thread will flush. The caller holds the lock."""
        outbox = self._outbox
        if not self._hub.defer_flush(self):
            self._send_queued()
            if outbox and not self.awaits_writable:
                self._hub.request_flush(self)
        if outbox.queued_bytes > MAX_QUEUED_BYTES:
            self.request_drop(f"it reads too slowly, with more than {MAX_QUEUED_BYTES} bytes queued")

    def _send_queued(self) -> None:
        """Send as many queued bytes as the socket accepts. The caller holds the lock."""
        if self.drop_reason:
            self._outbox = Outbox()  # frees the memory now, even if the server drops the session later
            return
        while frames := self._outbox.take_frames():
            try:
                sent_size = self.sock.send(frames)
            except BlockingIOError:
                sent_size = 0
            except OSError as error:
                self.send_failed = True
                self.request_drop(error.strerror or str(error))
                return
            if sent_size:
                self._last_progress_s = time.monotonic()
            if sent_size < len(frames):
                self._outbox.put_back(frames[sent_size:])
                return


class NetworkHandler(ABC):
    """Handles the frames of one component, in the server's thread."""

    COMPONENT: ClassVar[ComponentId]

    def start(self, hub: FawkesNetworkHub) -> None:  # noqa: B027 - a component need not override it
        """Prepare for clients."""

    @abstractmethod
    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        """Handle a client's request.

        :raises CxbridgeError: if the request is invalid; the server logs the error.
        """

    def disconnected(self, session: FawkesSession) -> None:  # noqa: B027 - a component need not override it
        """Remove the state of a client."""

    def stop(self) -> None:  # noqa: B027 - a component need not override it
        """Stop after all clients have been dropped."""
