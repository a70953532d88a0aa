"""The server of a blackboard for Fawkes' own tools, which it takes for a Fawkes.

One thread accepts, receives and drops; any thread sends through a session, and never waits.
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
from cxbridge.blackboard.fawkesnet.address import DEFAULT_PORT
from cxbridge.blackboard.fawkesnet.allowed_peers import AllowedPeers, resolve_listening
from cxbridge.blackboard.fawkesnet.components.blackboard import BlackBoardNetworkHandler
from cxbridge.blackboard.fawkesnet.messages.frames import FawkesFrame
from cxbridge.blackboard.fawkesnet.session import FawkesSession, NetworkHandler
from cxbridge.blackboard.fawkesnet.sockets import GONE_SECONDS, acknowledge, tune
from cxbridge.blackboard.kit.accepting import Shortage
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.kit.server import BoardServer
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.events import EventBus
from cxbridge.rights import EVERYTHING, Rights

NETWORK: Final = "FawkesNetworkServer"
"""Under which the server logs."""
HANDLER: Final = "BlackBoardNetworkHandler"
"""Under which the blackboard component logs, as Fawkes' does."""

_CHUNK: Final = 64 * 1024
_BACKLOG: Final = 512
_STOP_S: Final = 5.0
_PAUSE: Final = 0.5
"""Seconds without accepting when the process has no file descriptors left."""


@dataclass(frozen=True, slots=True)
class ServerLimits:
    """What clients may do to a server.

    :param stall_seconds: for so long a client may take nothing of what waits for it.
    :param most_clients: how many may be connected.
    :param gone_seconds: for so long a client's machine may give no sign of life; whole seconds.
    """

    stall_seconds: float = GONE_SECONDS
    most_clients: int = 2048
    gone_seconds: float = GONE_SECONDS


DEFAULT_LIMITS: Final = ServerLimits()


class FawkesServer(BoardServer):
    """Serves a blackboard by Fawkes' protocol, from :meth:`start` to :meth:`stop`.

    :param board: the served blackboard.
    :param host: where it listens; beyond the loopback only with ``allow``.
    :param port: 0 for any that is free, see :attr:`port`.
    :param bus: gets log lines; that of the board when None.
    :param components: more components: network logger, plugin manager, configuration.
    :param allow: addresses and networks that may connect, besides the loopback.
    :param echo: whether a writing client gets its own writes back, as from a Fawkes.
    :param limits: on clients.
    :param rights: what clients may do.
    :raises BlackBoardError: when it cannot listen there.
    """

    def __init__(  # noqa: PLR0913  as many options as a server has
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
        self._shortage = Shortage(self._warn)
        self._allowed: Final = AllowedPeers(allow)
        self._stall_seconds: Final = limits.stall_seconds
        self._most_clients: Final = limits.most_clients
        self._gone_seconds: Final = limits.gone_seconds
        handler = bus.logger(HANDLER)
        blackboard = BlackBoardNetworkHandler(
            board, handler, Complaints(handler.warn), echo=echo, rights=rights
        )
        self._components: Final = {int(one.COMPONENT): one for one in (blackboard, *components)}
        self._sessions: dict[int, FawkesSession] = {}
        self._numbers = itertools.count(1)
        self._attention: set[FawkesSession] = set()
        self._speaking: set[FawkesSession] = set()  # of whom something came in this round
        self._collecting = False
        self._resume_at = 0.0
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
                hint="does a Fawkes, or another cxbridge, run there already?",
            ) from None
        listener.setblocking(False)
        return listener

    # -- life

    def _prepare(self) -> None:
        self._selector.register(self._listener, selectors.EVENT_READ)
        self._selector.register(self._wakeup, selectors.EVENT_READ)
        for component in self._components.values():
            component.start(self)

    def stop(self, timeout: float | None = _STOP_S) -> None:
        """Close all connections and what their clients had open, and end; see the base class."""
        super().stop(timeout)

    def _release(self) -> None:
        self._selector.close()
        self._listener.close()

    @property
    def num_clients(self) -> int:
        """How many are connected."""
        return len(self._sessions)

    # -- for sessions and components: the hub

    def attend(self, session: FawkesSession) -> None:
        """See to a session soon."""
        self._attention.add(session)
        if not self.inside():
            self._wakeup.set()

    def collects(self, session: FawkesSession) -> bool:
        """Whether the caller is the server's thread amid its work: it sends all at the end of it."""
        if not self._collecting or not self.inside():
            return False
        if not session.watches_write:
            self._attention.add(session)
        return True

    def broadcast(self, frames: bytes) -> None:
        """Send to all clients."""
        for session in tuple(self._sessions.values()):
            session.send(frames)

    # -- the thread

    def _run(self) -> None:
        try:
            while not self._stopping:
                events = self._selector.select(self._patience())
                self._collecting = True
                for key, mask in events:
                    self._serve(key, mask)
                self._check_stalled()
                self._collecting = False
                self._see_to_attention()
        finally:
            self._collecting = False
            self._end()

    def _patience(self) -> float | None:
        """Return how long to sleep: forever, unless a client must be watched."""
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
            except OSError as error:  # no file descriptors left: the connection waits where it is
                self._shortage.report(error.strerror or str(error))
                self._selector.unregister(self._listener)
                self._resume_at = time.monotonic() + _PAUSE
                return
            self._welcome(sock, str(address[0]), f"{address[0]}:{address[1]}")

    def _welcome(self, sock: socket.socket, host: str, peer: str) -> None:
        if not self._allowed.admit(host):
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
        """Take received frames of a client; return whether there were any."""
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
        except ProtocolError as error:  # the stream cannot be followed any further
            self._complaints.add("stream", f"dropped {session!r}: {error.message}")
            self._drop(session, "")
            return False
        return True

    def _handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        component = self._components.get(frame.component)
        if component is None:
            self._complaints.add(
                "component",
                f"ignored what {session!r} sent for component {frame.component}, which is not there",
            )
            return
        try:
            component.handle(session, frame)
        except NoWriterError:
            pass  # the board has logged it, and the wire has no error for it
        except CxbridgeError as error:
            problem = f"{type(error).__name__} {frame.component}.{frame.kind}"
            self._complaints.add(problem, f"{session!r}: {error.message}")
        except Exception as error:  # noqa: BLE001 - one client's trouble is not the others'
            problem = f"{type(error).__name__} {frame.component}.{frame.kind}"
            self._complaints.add(problem, f"failed to serve {session!r}: {type(error).__name__}: {error}")

    def _see_to_attention(self) -> None:
        """Send what could not be sent at once, and drop who is to be dropped."""
        now = time.monotonic()
        if self._resume_at and now >= self._resume_at:
            self._resume_at = 0.0
            self._selector.register(self._listener, selectors.EVENT_READ)
        answered = list[FawkesSession]()
        while self._attention or answered:
            if self._attention:
                session = self._attention.pop()
                if session in self._speaking:  # news for other clients first: this one gets only its own
                    self._speaking.discard(session)
                    answered.append(session)
                    continue
            else:
                session = answered.pop()
            self._see_to(session)
        self._speaking.clear()

    def _see_to(self, session: FawkesSession) -> None:
        if self._sessions.get(session.number) is not session:
            return
        watched = session.watches_write
        watches = session.flush()
        if session.broken:
            # who closes a connection without having read everything resets it, with the last words in it
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
                session.condemn(f"it has taken nothing for {self._stall_seconds:g} s")

    def _drop(self, session: FawkesSession, reason: str) -> None:
        """End a session and close its open instances.

        :param reason: logged unless it is empty.
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

    def _end(self) -> None:
        self._listener.close()  # first: clients come back at once
        for session in tuple(self._sessions.values()):
            self._drop(session, "")
        for component in self._components.values():
            component.stop()
