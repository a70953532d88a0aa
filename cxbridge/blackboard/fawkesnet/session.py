"""A session of the server: a client's connection, limits and queued frames.

A blackboard calls listeners in the thread of the writer, which must not wait for a slow client. So sending
takes as many bytes as the socket accepts, and queues the rest for the server's thread.
"""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from abc import ABC, abstractmethod
from typing import ClassVar, Final, Protocol

from cxbridge.blackboard.fawkesnet.messages.codec import ALWAYS_ALLOWED, limit_to_server
from cxbridge.blackboard.fawkesnet.messages.frames import ComponentId, FawkesFrame, FrameDecoder
from cxbridge.blackboard.fawkesnet.outbox import MAX_QUEUED_BYTES, Outbox


class FawkesNetworkHub(Protocol):
    """The server's interface for sessions and components."""

    def attend(self, session: FawkesSession) -> None:
        """Handle a session soon, to flush or drop it."""

    def collects(self, session: FawkesSession) -> bool:
        """Return whether the calling thread will flush the session itself."""

    def broadcast(self, frames: bytes) -> None:
        """Send frames to all clients."""


class FawkesSession:
    """One client. Any thread may send, without blocking.

    :param number: the client's number, from 1, used only in logs.
    :param sock: a connected, non-blocking socket.
    :param peer: the client's address, for messages.
    :param hub: the server.
    """

    def __init__(self, number: int, sock: socket.socket, peer: str, hub: FawkesNetworkHub) -> None:
        self.number: Final = number
        self.sock: Final = sock
        self.peer: Final = peer
        self.largest_block = 0
        """The size of the largest block that the client may send now."""
        self.decoder: Final = FrameDecoder(self._limit, ALWAYS_ALLOWED)
        self.watches_write = False
        """Whether the server waits until the socket is writable."""
        self._hub: Final = hub
        self._outbox = Outbox()
        self._lock = threading.Lock()
        self._last_progress_s = time.monotonic()
        self._condemned = ""
        self.broken = False
        """Whether sending has failed. Received data are still readable."""

    def __repr__(self) -> str:
        return f"client {self.number} ({self.peer})"

    @property
    def condemned(self) -> str:
        """Why the session must be dropped; else empty."""
        return self._condemned

    def condemn(self, reason: str) -> None:
        """Request the end of the session, which the server's thread drops. Only the first reason counts."""
        self._condemned = self._condemned or reason
        self._hub.attend(self)

    def send(self, frames: bytes) -> None:
        """Send complete frames, or queue them for a slow client. Never blocks or fails."""
        with self._lock:
            self._outbox.put(frames)
            self._push()

    def send_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        """Send data of an instance, which may replace its queued older data.

        :param serial: 16 bytes.
        """
        with self._lock:
            self._outbox.put_data(serial, block, changed=changed)
            self._push()

    def flush(self) -> bool:
        """Send as many queued bytes as the socket accepts; return whether any remain.

        Sets :attr:`watches_write`.
        """
        with self._lock:
            self._flush()
            self.watches_write = bool(self._outbox)
            return self.watches_write

    def stalled_for(self, now: float) -> float:
        """Return the seconds since the last progress of queued frames."""
        return now - self._last_progress_s if self._outbox else 0.0

    def close(self) -> None:
        """Send as many queued bytes as possible without blocking, and end the connection."""
        if not self._condemned:
            self.flush()
        self._condemned = self._condemned or "closed"
        with self._lock:  # no other thread may send to a new socket with the same file descriptor
            with contextlib.suppress(OSError):
                self.sock.shutdown(socket.SHUT_RDWR)
            self.sock.close()

    def _limit(self, component: int, kind: int) -> int:
        return limit_to_server(component, kind, self.largest_block)

    def _push(self) -> None:
        """Flush unless the server's thread does it. The caller holds the lock."""
        outbox = self._outbox
        if not self._hub.collects(self):
            self._flush()
            if outbox and not self.watches_write:
                self._hub.attend(self)
        if outbox.overfull:
            self._condemned = self._condemned or f"it reads too slowly, {MAX_QUEUED_BYTES} bytes wait for it"
            self._hub.attend(self)

    def _flush(self) -> None:
        if self._condemned:
            self._outbox = Outbox()  # frees the memory now, even if the server drops the session later
            return
        while frames := self._outbox.take():
            try:
                sent = self.sock.send(frames)
            except BlockingIOError:
                sent = 0
            except OSError as error:
                self._condemned = error.strerror or str(error)
                self.broken = True
                self._hub.attend(self)
                return
            if sent:
                self._last_progress_s = time.monotonic()
            if sent < len(frames):
                self._outbox.put_back(frames[sent:])
                return


class NetworkHandler(ABC):
    """Handles the frames of one component, in the server's thread."""

    COMPONENT: ClassVar[ComponentId]

    def start(self, hub: FawkesNetworkHub) -> None:  # noqa: B027 - a component need not override it
        """Prepare for clients."""

    @abstractmethod
    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        """Handle a client's request.

        :raises CxbridgeError: if the request is invalid; the server logs it.
        """

    def disconnected(self, session: FawkesSession) -> None:  # noqa: B027 - a component need not override it
        """Remove the state of a client."""

    def stop(self) -> None:  # noqa: B027 - a component need not override it
        """Stop after all clients have been dropped."""
