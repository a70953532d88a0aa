"""A session of the server: one client's connection, its limits, and the frames that wait for it."""

from __future__ import annotations

import contextlib
import socket
import threading
import time
from abc import ABC, abstractmethod
from typing import ClassVar, Final, Protocol

from cxbridge.blackboard.fawkesnet.messages.codec import ALWAYS_ALLOWED, limit_to_server
from cxbridge.blackboard.fawkesnet.messages.frames import ComponentId, FawkesFrame, FrameDecoder
from cxbridge.blackboard.fawkesnet.outbox import MOST, Outbox


class FawkesNetworkHub(Protocol):
    """The server, as its sessions and components see it."""

    def attend(self, session: FawkesSession) -> None:
        """See to a session soon: something could not be sent at once, or it is to be dropped."""

    def collects(self, session: FawkesSession) -> bool:
        """Return whether the calling thread sends what waits for a client in a moment anyway."""

    def broadcast(self, frames: bytes) -> None:
        """Send to all clients."""


class FawkesSession:
    """One client. Anybody may send through it, from any thread, and never waits.

    :param number: the client's number, from 1; it is never on the wire.
    :param sock: connected, not blocking.
    :param peer: address of the client, for people.
    :param hub: the server.
    """

    def __init__(self, number: int, sock: socket.socket, peer: str, hub: FawkesNetworkHub) -> None:
        self.number: Final = number
        self.sock: Final = sock
        self.peer: Final = peer
        self.largest_block = 0
        """Bytes of the largest block that it may send now."""
        self.decoder: Final = FrameDecoder(self._limit, ALWAYS_ALLOWED)
        self.watches_write = False
        """Whether the server waits for the socket to take more."""
        self._hub: Final = hub
        self._outbox = Outbox()
        self._lock = threading.Lock()
        self._moved = time.monotonic()
        self._condemned = ""
        self.broken = False
        """Whether sending is impossible; received data can still be read."""

    def __repr__(self) -> str:
        return f"client {self.number} ({self.peer})"

    @property
    def condemned(self) -> str:
        """Why it has to be dropped; empty when it has not."""
        return self._condemned

    def condemn(self, reason: str) -> None:
        """Have it dropped soon; only the first reason counts."""
        self._condemned = self._condemned or reason
        self._hub.attend(self)

    def send(self, frames: bytes) -> None:
        """Send whole frames, or let them wait when the client is slow; never blocks, never fails."""
        with self._lock:
            self._outbox.put(frames)
            self._push()

    def send_data(self, serial: bytes, block: bytes, *, changed: bool) -> None:
        """Send data of an instance; older data of it that wait may be replaced.

        :param serial: 16 bytes.
        """
        with self._lock:
            self._outbox.put_data(serial, block, changed=changed)
            self._push()

    def flush(self) -> bool:
        """Send what waits, as much as the socket takes; return whether something still waits.

        The server then has to wait for the socket to take more, as :attr:`watches_write` says from now on.
        """
        with self._lock:
            self._flush()
            self.watches_write = bool(self._outbox)
            return self.watches_write

    def stalled_for(self, now: float) -> float:
        """Return for how many seconds something has been waiting and nothing has moved."""
        return now - self._moved if self._outbox else 0.0

    def close(self) -> None:
        """Send as much as the socket takes at once, and end the connection."""
        if not self._condemned:
            self.flush()
        self._condemned = self._condemned or "closed"
        with self._lock:  # no thread sends to the next socket with this number
            with contextlib.suppress(OSError):
                self.sock.shutdown(socket.SHUT_RDWR)
            self.sock.close()

    def _limit(self, component: int, kind: int) -> int:
        return limit_to_server(component, kind, self.largest_block)

    def _push(self) -> None:
        """Send at once if the server does not do so in a moment; its lock is held."""
        outbox = self._outbox
        if not self._hub.collects(self):
            self._flush()
            if outbox and not self.watches_write:
                self._hub.attend(self)
        if outbox.overfull:
            self._condemned = self._condemned or f"it reads too slowly, {MOST} bytes wait for it"
            self._hub.attend(self)

    def _flush(self) -> None:
        if self._condemned:
            self._outbox = Outbox()
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
                self._moved = time.monotonic()
            if sent < len(frames):
                self._outbox.put_back(frames[sent:])
                return


class NetworkHandler(ABC):
    """Answers the frames for one component.

    All methods are called in the server's thread.
    """

    COMPONENT: ClassVar[ComponentId]

    def start(self, hub: FawkesNetworkHub) -> None:  # noqa: B027 - not everybody has something to prepare
        """Prepare for clients."""

    @abstractmethod
    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        """Carry out the request of a client.

        :raises CxbridgeError: when the request is invalid; the server logs it.
        """

    def disconnected(self, session: FawkesSession) -> None:  # noqa: B027 - not everybody remembers clients
        """Forget a client."""

    def stop(self) -> None:  # noqa: B027 - not everybody has something to end
        """End; there are no clients any more."""
