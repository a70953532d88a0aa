"""The server of a blackboard for Fawkes' tools, to which it looks like Fawkes.

One thread accepts, receives and drops clients, in rounds: it handles the frames of all readable sockets, then
sends the queued replies. Any thread may send through a session without blocking.
"""

from __future__ import annotations

import itertools
import selectors
import socket
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Final

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.errors import NoWriterError
from cxbridge.blackboard.fawkesnet.allowed_peers import AllowedPeers, resolve_listening
from cxbridge.blackboard.fawkesnet.components.blackboard import BlackBoardNetworkHandler
from cxbridge.blackboard.fawkesnet.messages.frames import FawkesFrame
from cxbridge.blackboard.fawkesnet.session import FawkesSession, NetworkHandler
from cxbridge.blackboard.fawkesnet.sockets import DEFAULT_PORT, GONE_SECONDS, acknowledge, tune
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.kit.server import BoardServer
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.events import EventBus
from cxbridge.rights import EVERYTHING, Rights

NETWORK: Final = "FawkesNetworkServer"
"""The server's log component."""
HANDLER: Final = "BlackBoardNetworkHandler"
"""The log component of the blackboard component, as in Fawkes."""

_CHUNK: Final = 64 * 1024  # bytes of one read
_BACKLOG: Final = 512  # clients that connect at once, and connections accepted in a row
_STOP_S: Final = 5.0  # a handler that does not return must not block the end of the process
_PAUSE_S: Final = 0.5  # without accepting, when the process has no file descriptors left


@dataclass(frozen=True, slots=True)
class ServerLimits:
    """Limits of clients.

    :param stall_seconds: the time in which a client must receive some queued bytes.
    :param most_clients: the maximum number of clients.
    :param gone_seconds: the time in which a client's machine must show a sign of life; whole seconds.
    """

    stall_seconds: float = GONE_SECONDS
    most_clients: int = 2048
    gone_seconds: float = GONE_SECONDS


DEFAULT_LIMITS: Final = ServerLimits()


class FawkesServer(BoardServer):
    """Serves a blackboard by Fawkes' protocol, between :meth:`start` and :meth:`stop`.

    :param host: the listening address; beyond the loopback only with ``allow``.
    :param port: the listening port; 0 for any free port, see :attr:`port`.
    :param bus: gets log lines, by default the board's bus.
    :param components: further components: network logger, plugin manager, configuration.
    :param allow: addresses and networks that may connect, in addition to the loopback.
    :param echo: whether clients receive their own writes, as from Fawkes.
    :raises BlackBoardError: if the address cannot be used.
    """

    def __init__(  # noqa: PLR0913 - all settings are passed by name
        self,
        board: BlackBoard,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        bus: EventBus | None = None,
        components: Iterable[NetworkHandler] = (),
        allow: Iterable[str] = (),
        echo: bool = True,
        limits: ServerLimits = DEFAULT_LIMITS,
        rights: Rights = EVERYTHING,
    ) -> None:
        bus = bus or board.bus or EventBus(board.clock)
        super().__init__("FawkesNetServer", bus.logger(NETWORK))
        self._allowed: Final = AllowedPeers(allow)
        self._stall_seconds: Final = limits.stall_seconds
        self._most_clients: Final = limits.most_clients
        self._gone_seconds: Final = limits.gone_seconds
        handler = bus.logger(HANDLER)
        blackboard = BlackBoardNetworkHandler(
            board, handler, Complaints(handler.warn), echo=echo, rights=rights
        )
        self._components: Final = {
            int(component.COMPONENT): component for component in (blackboard, *components)
        }
        self._sessions: dict[int, FawkesSession] = {}
        self._numbers = itertools.count(1)
        self._attention: set[FawkesSession] = set()  # sessions to be flushed or dropped
        self._speaking: set[FawkesSession] = set()  # clients with received frames in this round
        self._collecting = False  # whether a round is in progress, which flushes all sessions at its end
        self._resume_at = 0.0  # the monotonic time at which accepting resumes; 0 while it is not paused
        self._listener = self._listen(host, port)
        self.host, self.port = self._listener.getsockname()[:2]
        self._selector = selectors.DefaultSelector()

    def _listen(self, host: str, port: int) -> socket.socket:
        family, address = resolve_listening(host, port, self._allowed)
        listener = socket.socket(family, socket.SOCK_STREAM)
        try:
            listener.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            listener.bind(address)
            listener.listen(_BACKLOG)
        except OSError as error:
            listener.close()
            raise BlackBoardError(
                f"cannot listen on {host}:{port}: {error.strerror}",
                hint="does Fawkes, or another cxbridge, run there already?",
            ) from None
        listener.setblocking(False)
        return listener

    def _prepare(self) -> None:
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._wakeup, selectors.EVENT_READ)
        for component in self._components.values():
            component.start(self)

    def stop(self, timeout: float | None = _STOP_S) -> None:
        """Close all connections and their instances, and stop."""
        super().stop(timeout)

    def _release(self) -> None:
        self._selector.close()
        self._listener.close()

    @property
    def num_clients(self) -> int:
        """The number of connected clients."""
        return len(self._sessions)

    def attend(self, session: FawkesSession) -> None:
        """Handle a session soon."""
        self._attention.add(session)
        if not self.is_current_thread():
            self._wakeup.set()

    def collects(self, session: FawkesSession) -> bool:
        """Return whether the caller is the server's thread in a round, which flushes sessions at its end."""
        if not self._collecting or not self.is_current_thread():
            return False
        if not session.watches_write:
            self._attention.add(session)
        return True

    def broadcast(self, frames: bytes) -> None:
        """Send frames to all clients."""
        for session in tuple(self._sessions.values()):
            session.send(frames)

    def _run(self) -> None:
        try:
            while not self._stopping:
                events = self._selector.select(self._patience())
                self._collecting = True
                for key, mask in events:
                    self._serve(key, mask)
                self._check_stalled()
                self._collecting = False
                self._finish_round()
        finally:
            self._collecting = False
            self._end_sessions()

    def _patience(self) -> float | None:
        """Return the seconds until the next check; None to wait for events only."""
        if self._resume_at:
            return max(self._resume_at - time.monotonic(), 0.0)
        slow = any(session.watches_write for session in self._sessions.values())
        return min(self._stall_seconds / 4, 1.0) if slow else None

    def _serve(self, key: selectors.SelectorKey, mask: int) -> None:
        if key.fileobj is self._listener:
            self._accept()
        elif key.fileobj is self._wakeup:
            self._wakeup.clear()
        else:
            session: FawkesSession = key.data
            if mask & selectors.EVENT_WRITE:
                self._attention.add(session)
            if mask & selectors.EVENT_READ:
                self._speaking.add(session)
                self._receive(session)

    def _accept(self) -> None:
        for _ in range(_BACKLOG):
            try:
                sock, address = self._listener.accept()
            except (BlockingIOError, ConnectionAbortedError):
                return
            except OSError as error:  # no file descriptors left: the connection waits in the kernel's queue
                # a listener that stays readable would keep the thread busy
                self._complaints.add("accept", f"cannot accept connections: {error.strerror}; they wait")
                self._selector.unregister(self._listener)
                self._resume_at = time.monotonic() + _PAUSE_S
                return
            self._welcome(sock, str(address[0]), f"{address[0]}:{address[1]}")

    def _welcome(self, sock: socket.socket, host: str, peer: str) -> None:
        if not self._allowed.admits(host):
            self._complaints.add(f"peer {host}", f"refused {peer}: it is not among the allowed peers")
            sock.close()
            return
        if len(self._sessions) >= self._most_clients:
            self._complaints.add("clients", f"refused {peer}: {self._most_clients} clients are connected")
            sock.close()
            return
        sock.setblocking(False)
        tune(sock, self._gone_seconds)
        session = FawkesSession(next(self._numbers), sock, peer, self)
        self._sessions[session.number] = session
        self._selector.register(sock, selectors.EVENT_READ, session)

    def _receive(self, session: FawkesSession) -> bool:
        """Handle the received frames of a client; return whether there were any."""
        try:
            data = session.sock.recv(_CHUNK)
        except BlockingIOError:
            return False
        except OSError as error:
            self._drop(session, error.strerror or str(error))
            return False
        if not data:
            self._drop(session, "")
            return False
        acknowledge(session.sock)
        try:
            for frame in session.decoder.feed(data):
                self._handle(session, frame)
        except ProtocolError as error:  # the rest of the stream cannot be decoded
            self._complaints.add("stream", f"dropped {session!r}: {error.message}")
            self._drop(session, "")
            return False
        return True

    def _handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        component = self._components.get(frame.component)
        if component is None:
            self._complaints.add(
                "component",
                f"ignored a message of {session!r} to component {frame.component}, which does not exist",
            )
            return
        try:
            component.handle(session, frame)
        except NoWriterError:
            pass  # the board has logged it, and the protocol has no reply for it
        except CxbridgeError as error:
            problem = f"{type(error).__name__} {frame.component}.{frame.kind}"
            self._complaints.add(problem, f"{session!r}: {error.message}")
        except Exception as error:  # noqa: BLE001 - other clients must be served further
            problem = f"{type(error).__name__} {frame.component}.{frame.kind}"
            self._complaints.add(problem, f"failed to serve {session!r}: {type(error).__name__}: {error}")

    def _finish_round(self) -> None:
        """Flush sessions with queued frames, and drop condemned ones."""
        now = time.monotonic()
        if self._resume_at and now >= self._resume_at:
            self._resume_at = 0.0
            self._selector.register(self._listener, selectors.EVENT_READ)
        deferred = list[FawkesSession]()
        while self._attention or deferred:
            if self._attention:
                session = self._attention.pop()
                # first the clients that sent nothing in this round, usually readers that wait for an update:
                # to wake the speaking ones first would let them compete for the processor
                if session in self._speaking:
                    self._speaking.discard(session)
                    deferred.append(session)
                    continue
            else:
                session = deferred.pop()
            self._flush_or_drop(session)
        self._speaking.clear()

    def _flush_or_drop(self, session: FawkesSession) -> None:
        if self._sessions.get(session.number) is not session:
            return  # dropped in this round
        watched = session.watches_write
        watches = session.flush()
        if session.broken:
            # closing a socket with unread data resets the connection and loses the last sent frames
            while session.number in self._sessions and self._receive(session):
                pass
        if session.condemned:
            self._drop(session, session.condemned)
        elif watches != watched:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if watches else 0)
            self._selector.modify(session.sock, events, session)

    def _check_stalled(self) -> None:
        now = time.monotonic()
        for session in self._sessions.values():
            if session.watches_write and session.stalled_for(now) > self._stall_seconds:
                session.condemn(f"it has not accepted data for {self._stall_seconds:g} s")

    def _drop(self, session: FawkesSession, reason: str) -> None:
        """End a session and close its instances.

        :param reason: the text of the log line; empty for an end that is not logged.
        """
        if self._sessions.pop(session.number, None) is None:
            return
        if reason:
            self._complaints.add(f"drop {reason}", f"dropped {session!r}: {reason}")
        self._selector.unregister(session.sock)
        session.close()
        for component in self._components.values():
            try:
                component.disconnected(session)
            except CxbridgeError as error:
                self._complaints.add("disconnected", f"{session!r}: {error.message}")

    def _end_sessions(self) -> None:
        self._listener.close()  # first, because clients reconnect immediately
        for session in tuple(self._sessions.values()):
            self._drop(session, "")
        for component in self._components.values():
            component.stop()
