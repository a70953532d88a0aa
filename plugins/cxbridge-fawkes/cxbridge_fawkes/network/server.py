"""The server that makes a blackboard appear as Fawkes to Fawkes' tools.

One thread accepts, serves and drops clients in rounds: it handles the received frames of all readable
sockets, then sends the queued replies. Any thread may send through a session without blocking.
"""

from __future__ import annotations

import itertools
import selectors
import socket
import time
from collections.abc import Iterable, Sequence
from typing import Final

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.errors import NoWriterError
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.kit.server import BoardServer
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.events import EventBus
from cxbridge.listening import check_server_address, is_loopback, listen
from cxbridge.rights import ALL_RIGHTS, Rights
from cxbridge_fawkes.network.allowed_peers import AllowedPeers
from cxbridge_fawkes.network.components.blackboard import BlackBoardNetworkHandler
from cxbridge_fawkes.network.messages.frames import FawkesFrame
from cxbridge_fawkes.network.session import FawkesSession, NetworkHandler
from cxbridge_fawkes.network.sockets import (
    DEFAULT_PORT,
    GONE_TIMEOUT_S,
    acknowledge_at_once,
    configure_socket,
)

SERVER_COMPONENT: Final = "FawkesNetworkServer"
"""The component of the server's log lines."""
HANDLER_COMPONENT: Final = "BlackBoardNetworkHandler"
"""The component of the log lines about the blackboard's clients, as in Fawkes."""

_READ_BYTES: Final = 64 * 1024  # the maximal size of one read
_MAX_BACKLOG: Final = 512  # the number of clients that may connect at once, chosen freely
_STOP_TIMEOUT_S: Final = 5.0  # a handler that does not return must not block the end of the process
_ACCEPT_PAUSE_S: Final = 0.02  # the pause of each round while the process has no free file descriptor


# chosen freely; a test opens a thousand clients, which take less than 100 MiB
MAX_CLIENTS: Final = 2048
"""The maximum number of clients."""

STALL_S: Final = GONE_TIMEOUT_S
"""The seconds in which a client must accept some of its queued bytes."""


class FawkesServer(BoardServer):
    """Serves a blackboard by Fawkes' protocol, between :meth:`start` and :meth:`stop`.

    :param board: the served blackboard.
    :param host: the listening address; beyond the loopback only with ``allow``.
    :param port: the listening port; 0 for any free port, see :attr:`port`.
    :param bus: gets log lines, by default the board's bus.
    :param components: further components: network logger, plugin manager, configuration.
    :param allow: addresses and networks that may connect, in addition to the loopback.
    :param rights: what clients may write and send.
    :raises BlackBoardError: if the address cannot be used, or ``allow`` is invalid.
    """

    def __init__(
        self,
        board: BlackBoard,
        host: str = "127.0.0.1",
        port: int = DEFAULT_PORT,
        *,
        bus: EventBus | None = None,
        components: Iterable[NetworkHandler] = (),
        allow: Sequence[str] = (),
        rights: Rights = ALL_RIGHTS,
    ) -> None:
        bus = bus or board.bus or EventBus(board.clock)
        super().__init__("FawkesNetServer", bus.logger(SERVER_COMPONENT))
        self._allowed_peers: Final = AllowedPeers(allow)
        logger = bus.logger(HANDLER_COMPONENT)
        blackboard = BlackBoardNetworkHandler(board, logger, Complaints(logger.warn), rights)
        self._components: Final = {
            int(component.COMPONENT): component for component in (blackboard, *components)
        }
        self._sessions: dict[int, FawkesSession] = {}  # by number
        self._session_numbers = itertools.count(1)
        self._sessions_to_flush: set[FawkesSession] = set()  # includes sessions to drop
        self._active_sessions: set[FawkesSession] = set()  # sessions that sent data in this round
        self._is_in_round = False  # a round flushes sessions at its end
        self._listener = self._listen(host, port, allow)
        self.host, self.port = self._listener.getsockname()[:2]
        self._selector = selectors.DefaultSelector()

    @staticmethod
    def _listen(host: str, port: int, allow: Sequence[str]) -> socket.socket:
        check_server_address(
            "the port for Fawkes' tools",
            host,
            is_local=is_loopback(host),
            is_restricted=bool(allow),
            hint="the protocol has no login: say which peers are allowed, e.g. 192.168.0.0/24, "
            "or listen on 127.0.0.1",
            error_class=BlackBoardError,
        )
        listener = listen(
            "the server for Fawkes' tools",
            host,
            port,
            hint="is Fawkes or another cxbridge running there already?",
            backlog=_MAX_BACKLOG,
            error_class=BlackBoardError,
        )
        listener.setblocking(False)
        return listener

    def _prepare(self) -> None:
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._wakeup, selectors.EVENT_READ)
        for component in self._components.values():
            component.start(self)

    def stop(self, timeout: float | None = _STOP_TIMEOUT_S) -> None:
        """Close all connections and their instances, and stop."""
        super().stop(timeout)

    def _release(self) -> None:
        self._selector.close()
        self._listener.close()

    def request_flush(self, session: FawkesSession) -> None:
        """Flush or drop a session soon, in the server's thread."""
        self._sessions_to_flush.add(session)
        if not self.is_current_thread():
            self._wakeup.set()

    def defer_flush(self, session: FawkesSession) -> bool:
        """Defer the flush of a session to the end of the round.

        :returns: False without effect, if the caller is not the server's thread in a round.
        """
        if not self._is_in_round or not self.is_current_thread():
            return False
        if not session.awaits_writable:
            self._sessions_to_flush.add(session)
        return True

    def broadcast(self, frames: bytes) -> None:
        """Send frames to all clients."""
        for session in tuple(self._sessions.values()):
            session.send(frames)

    def _run(self) -> None:
        try:
            while not self._is_stopping:
                events = self._selector.select(self._poll_timeout_s())
                self._is_in_round = True
                for key, mask in events:
                    self._handle_event(key, mask)
                self._drop_stalled()
                self._is_in_round = False
                self._finish_round()
        finally:
            self._is_in_round = False
            self._end_sessions()

    def _poll_timeout_s(self) -> float | None:
        """Return the seconds until the next check; None to wait for events only."""
        has_slow_client = any(session.awaits_writable for session in self._sessions.values())
        # a stalled client is dropped at most a second after its limit
        return min(STALL_S / 4, 1.0) if has_slow_client else None

    def _handle_event(self, key: selectors.SelectorKey, mask: int) -> None:
        if key.fileobj is self._listener:
            self._accept()
        elif key.fileobj is self._wakeup:
            self._wakeup.clear()
        else:
            session: FawkesSession = key.data
            if mask & selectors.EVENT_WRITE:
                self._sessions_to_flush.add(session)
            if mask & selectors.EVENT_READ:
                self._active_sessions.add(session)
                self._receive(session)

    def _accept(self) -> None:
        try:
            sock, address = self._listener.accept()
        except (BlockingIOError, ConnectionAbortedError):  # the client has disconnected already
            return
        except OSError as error:  # no free file descriptor: the connection waits in the kernel's queue
            self._complaints.add(
                "accept", f"cannot accept connections: {error.strerror}; new clients must wait"
            )
            time.sleep(_ACCEPT_PAUSE_S)  # the listener stays readable, which would keep the thread busy
            return
        # an address begins with host and port
        self._add_client(sock, str(address[0]), f"{address[0]}:{address[1]}")

    def _add_client(self, sock: socket.socket, host: str, peer: str) -> None:
        if not self._allowed_peers.admits(host):
            self._complaints.add(f"peer {host}", f"refused {peer}: it is not among the allowed peers")
            sock.close()
            return
        if len(self._sessions) >= MAX_CLIENTS:
            self._complaints.add("clients", f"refused {peer}: {len(self._sessions)} clients are connected")
            sock.close()
            return
        sock.setblocking(False)
        configure_socket(sock)
        session = FawkesSession(next(self._session_numbers), sock, peer, self)
        self._sessions[session.number] = session
        self._selector.register(sock, selectors.EVENT_READ, session)

    def _receive(self, session: FawkesSession) -> bool:
        """Handle the received data of a client; return whether the client may have sent more."""
        try:
            chunk = session.sock.recv(_READ_BYTES)
        except BlockingIOError:
            return False
        except OSError as error:
            self._drop(session, error.strerror or str(error))
            return False
        if not chunk:
            self._drop(session, "")
            return False
        acknowledge_at_once(session.sock)
        try:
            for frame in session.decoder.feed(chunk):
                self._handle_frame(session, frame)
        except ProtocolError as error:  # the rest of the stream cannot be decoded
            self._complaints.add("stream", f"dropped {session!r}: {error.message}")
            self._drop(session, "")
            return False
        return True

    def _handle_frame(self, session: FawkesSession, frame: FawkesFrame) -> None:
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
            pass  # the board has logged the refused message, and the protocol has no reply to a message
        except Exception as error:  # noqa: BLE001 - the server must serve the other clients
            complaint = f"failed to serve {session!r}: {type(error).__name__}: {error}"
            if isinstance(error, CxbridgeError):  # a mistake of the client
                complaint = f"{session!r}: {error.message}"
            self._complaints.add(f"{type(error).__name__} {frame.component}.{frame.kind}", complaint)

    def _finish_round(self) -> None:
        """Flush sessions with queued frames, and drop sessions with a reason to drop."""
        deferred_sessions = list[FawkesSession]()
        while self._sessions_to_flush or deferred_sessions:
            if self._sessions_to_flush:
                session = self._sessions_to_flush.pop()
                # first the clients that sent nothing in this round, usually readers that wait for an update;
                # an active client that is woken first would compete with them for the processor
                if session in self._active_sessions:
                    self._active_sessions.discard(session)
                    deferred_sessions.append(session)
                    continue
            else:
                session = deferred_sessions.pop()
            self._flush_or_drop(session)
        self._active_sessions.clear()

    def _flush_or_drop(self, session: FawkesSession) -> None:
        if self._sessions.get(session.number) is not session:
            return  # the session was dropped in this round
        was_awaiting = session.awaits_writable
        is_awaiting = session.flush()
        if session.send_failed:
            # a client that closes its socket with unread data resets the connection, so that sending fails
            # before its last frames are read
            while session.number in self._sessions and self._receive(session):
                pass
        if session.drop_reason:
            self._drop(session, session.drop_reason)
        elif is_awaiting != was_awaiting:
            events = selectors.EVENT_READ | (selectors.EVENT_WRITE if is_awaiting else 0)
            self._selector.modify(session.sock, events, session)

    def _drop_stalled(self) -> None:
        now_s = time.monotonic()
        for session in self._sessions.values():
            if session.awaits_writable and session.stalled_s(now_s) > STALL_S:
                session.request_drop(f"it has not accepted data for {STALL_S:g} s")

    def _drop(self, session: FawkesSession, reason: str) -> None:
        """End a session and close its instances.

        :param reason: the text of the log line; empty for no log line.
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
        self._listener.close()  # first, because a dropped client reconnects immediately
        for session in tuple(self._sessions.values()):
            self._drop(session, "")
        for component in self._components.values():
            component.stop()
