"""The server of a local blackboard over ZeroMQ: sockets, sessions and their thread.

One thread owns all of this. It alternates between posted calls, frames of clients and checks of the sessions,
and sleeps until a socket or another thread wakes it.
"""

from __future__ import annotations

import contextlib
import os
import select
import sys
import time
from collections import deque
from collections.abc import Callable, Sequence
from functools import partial
from typing import Any, Final

import zmq

from cxbridge.blackboard.base import COMPONENT
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.kit.server import BoardServer
from cxbridge.blackboard.listeners import Observer
from cxbridge.blackboard.local import LocalBlackBoard
from cxbridge.blackboard.zmq.security import CurveServer, check_endpoint
from cxbridge.blackboard.zmq.server.requests import RequestHandler
from cxbridge.blackboard.zmq.server.sessions import ZmqSession
from cxbridge.blackboard.zmq.wire.frames import (
    COMMANDS,
    EVENTS,
    SERIAL_SIZE,
    Bye,
    Existence,
    Gone,
    Hello,
    ResultCode,
    Welcome,
    decode_client_frame,
    encode,
)
from cxbridge.blackboard.zmq.wire.sockets import (
    FAREWELL_MS,
    NOBLOCK,
    EndpointFile,
    bind,
    context_for,
    readable,
    receiver,
    skip_parts,
)
from cxbridge.rights import EVERYTHING, Rights

MIN_HEARTBEAT: Final = 0.05
"""The shortest heartbeat in seconds."""

MAX_SESSIONS: Final = 1024
"""The maximal number of clients."""

# A reader that waits for a core misses some 5 ms. At 100,000 updates a second 256 updates take 2.6 ms:
# half of a burst was conflated.
WINDOW: Final = 1024
"""The maximal number of unacknowledged updates per client."""

_BATCH: Final = 64  # messages of one socket before the next socket is served
_TICKS: Final = 4  # checks of the sessions per heartbeat


class ZmqBlackBoardServer(BoardServer, Observer):
    """Serves a local blackboard to clients in threads, processes and on other machines.

    :param board: the blackboard; its owner shuts it down.
    :param endpoints: ``tcp://host:port`` (``*``: any port), ``ipc://path`` or ``inproc://name``.
    :param heartbeat: the seconds between signs of life; clients may demand fewer.
    :param keys: the CURVE keys, required for endpoints that other machines can reach.
    :param insecure: whether such endpoints are allowed without keys.
    :param window: the maximal number of unacknowledged updates per client.
    :param context: the ZeroMQ context; by default a new context, or for inproc that of the process.
    :raises InsecureEndpointError: if an endpoint needs keys.
    """

    def __init__(  # noqa: PLR0913 - all settings are passed by name
        self,
        board: LocalBlackBoard,
        endpoints: Sequence[str],
        *,
        heartbeat: float = 1.0,
        keys: CurveServer | None = None,
        insecure: bool = False,
        window: int = WINDOW,
        max_sessions: int = MAX_SESSIONS,
        rights: Rights = EVERYTHING,
        context: zmq.Context[zmq.Socket[bytes]] | None = None,
    ) -> None:
        for endpoint in endpoints:
            check_endpoint(endpoint, keys=keys is not None, insecure=insecure)
        name = f"{COMPONENT}Server"
        super().__init__(name, None if board.bus is None else board.bus.logger(name))
        self.board: Final = board
        self.heartbeat: Final = max(heartbeat, MIN_HEARTBEAT)
        self.endpoints: list[str] = list(endpoints)
        """The endpoints, with the actual ports after the start."""
        self._keys = keys
        self._window = window
        self._max_sessions = max_sessions
        self._lent_context = context
        # the attributes from here on are set while the server runs
        self._context: zmq.Context[zmq.Socket[bytes]] | None = None
        self._own_context = False
        self._authenticator: Any = None
        self._epoch = b""
        self._sockets: list[zmq.Socket[bytes]] = []
        self._files: list[EndpointFile] = []
        self._sessions: dict[bytes, ZmqSession] = {}
        self._failed: deque[tuple[ZmqSession, ResultCode]] = deque()
        self._inbox: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()
        self._skipped = 0
        # three heartbeats, as for other signs of life; at least a second, because a listener may take a while
        patience = max(3 * self.heartbeat, 1.0)
        self._requests: Final = RequestHandler(
            board, self, patience, partial(self._complaints.add, "request"), rights
        )

    def _prepare(self) -> None:
        """Bind the sockets."""
        self._epoch = os.urandom(SERIAL_SIZE)
        self._context, self._own_context = context_for(self._lent_context, self.endpoints)
        self._authenticator = self._authenticate(self._context)
        for index, endpoint in enumerate(self.endpoints):
            socket, self.endpoints[index] = bind(self._context, endpoint, self._keys)
            self._sockets.append(socket)
            self._files.append(EndpointFile(endpoint))
        self.board.register_observer(self)
        self._info(f"serving at {', '.join(self.endpoints)}")

    def _authenticate(self, context: zmq.Context[zmq.Socket[bytes]]) -> Any:
        """Start the thread that checks the keys of clients."""
        if self._keys is None:
            return None
        from zmq.auth.thread import ThreadAuthenticator  # noqa: PLC0415 - imports asyncio

        authenticator = ThreadAuthenticator(context)
        authenticator.start()
        authenticator.configure_curve(domain="*", location=self._keys.clients)
        return authenticator

    def _release(self) -> None:
        self.board.unregister_observer(self)
        for file in self._files:  # before the endpoints are unbound, see EndpointFile.remove
            file.remove()
        for socket, endpoint in zip(self._sockets, self.endpoints, strict=False):
            with contextlib.suppress(zmq.ZMQError):  # the file of the endpoint may be removed
                socket.unbind(endpoint)  # releases the endpoint at once for another server
            socket.close(linger=FAREWELL_MS)
        self._sockets.clear()
        if self._authenticator is not None:
            self._authenticator.stop()
        if self._context is not None and self._own_context:
            self._context.term()

    @property
    def skipped(self) -> int:
        """The number of updates that were conflated for slow clients."""
        return self._skipped + sum(session.skipped for session in tuple(self._sessions.values()))

    @property
    def sessions(self) -> int:
        """The number of clients."""
        return len(self._sessions)

    def post(self, work: Callable[..., None], *args: Any) -> None:
        """Call a function in the server's thread; calls stay in order."""
        self._inbox.append((work, args))
        self._wakeup.set()

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:
        """Notify the clients that watch."""
        if self.is_current_thread():
            self._send_existence(created, interface_type, interface_id)
        else:
            self.post(self._send_existence, created, interface_type, interface_id)

    def _send_existence(self, created: bool, interface_type: str, interface_id: str) -> None:
        for session in tuple(self._sessions.values()):
            if session.watching:
                session.send(Existence(created, interface_type, interface_id))

    def _run(self) -> None:
        self._by_descriptor = {socket.fileno(): socket for socket in self._sockets}
        if sys.platform == "win32":
            return  # the context refuses Windows
        poll = select.poll()
        poll.register(self._wakeup, select.POLLIN)
        for descriptor in self._by_descriptor:
            poll.register(descriptor, select.POLLIN)
        due = checked = time.monotonic()
        # a single message per round while there are few, so that posted updates do not wait for a batch
        batch = 1
        ready: Sequence[tuple[int, int]] = ()
        while not self._stopping:
            self._wakeup.clear()
            self.drain()
            self._end_failed()
            now = time.monotonic()
            if now >= due:
                self._check_sessions(now, now - checked)
                shortest = min((s.heartbeat for s in self._sessions.values()), default=self.heartbeat)
                checked, due = now, now + shortest / _TICKS
            # ZeroMQ's descriptors only report events since the last look, and sending looks, too: nothing may
            # be sent between the last look and the poll
            if self._receive(batch, ready):
                batch, ready = _BATCH, ()
            else:
                batch = 1
                ready = poll.poll(max(0.0, due - time.monotonic()) * 1000 + 1)
        for session in tuple(self._sessions.values()):
            session.send(Gone(ResultCode.SHUTDOWN, "the server stops"))
            self._end_session(session)
        self.drain()

    def drain(self) -> None:
        """Carry out the posted calls."""
        while self._inbox:
            work, args = self._inbox.popleft()
            try:
                work(*args)
            except Exception as error:  # noqa: BLE001 - other clients must be served further
                self._complaints.add(type(error).__name__, f"{work.__name__} failed: {error!r}")

    def _receive(self, batch: int, ready: Sequence[tuple[int, int]]) -> bool:
        """Handle received messages, at most one batch per socket; return whether there may be more.

        :param ready: descriptors that the poll just reported.
        """
        if ready:
            sockets = [self._by_descriptor[fd] for fd, _ in ready if fd in self._by_descriptor]
        else:
            sockets = [socket for socket in self._sockets if readable(socket)]
        for socket in sockets:
            self._receive_by(socket, batch)
        return bool(ready or sockets)

    def _receive_by(self, socket: zmq.Socket[bytes], batch: int) -> None:
        recv = receiver(socket)
        for _ in range(batch):
            try:
                route = recv(NOBLOCK)
            except zmq.Again:
                return
            # a part instead of bytes, because asking the socket for further parts would cost more
            part = recv(0, False)
            surplus = skip_parts(socket) if part.more else 0
            try:
                self._handle_message(socket, route, part.bytes, surplus)
            except ProtocolError as error:
                # the kind of the complaint is the start of the text, because the rest may quote the client
                self._complaints.add(str(error.message)[:40], f"a client was sent away: {error.message}")
                self._send_away(socket, route, ResultCode.PROTOCOL, error.message)
            except Exception as error:  # noqa: BLE001 - a client's frame must not end the service of others
                self._complaints.add(type(error).__name__, f"a client was sent away: {error!r}")
                self._send_away(socket, route, ResultCode.REFUSED, "the server failed")

    def _handle_message(self, socket: zmq.Socket[bytes], route: bytes, data: bytes, surplus: int) -> None:
        """Handle one message.

        :param surplus: the number of parts after the frame, which no message may have.
        """
        session = self._sessions.get(route[1:])
        if session is not None and session.failed:
            return
        if surplus:
            raise ProtocolError(f"a message has one frame, not {1 + surplus}")
        frame = decode_client_frame(data)
        if session is None or route[:1] != COMMANDS:
            if isinstance(frame, Hello):
                self._welcome(socket, route, frame)
            elif session is None:
                self._send_away(socket, route, ResultCode.UNKNOWN_SESSION, "there is no such session")
        elif self._accept_number(session, frame.number):
            if isinstance(frame, Bye):
                self._end_session(session)
            else:
                self._requests.handle(session, frame)

    def _accept_number(self, session: ZmqSession, number: int) -> bool:
        """Record a frame's number and return whether it is the expected one."""
        session.last_received_s = time.monotonic()
        if number == session.numbers_in + 1:
            session.numbers_in = number
            return True
        if number > session.numbers_in:
            self._fail(session, ResultCode.FRAME_LOST)
        return False

    def _welcome(self, socket: zmq.Socket[bytes], route: bytes, hello: Hello) -> None:
        """Begin a session."""
        if route != EVENTS + hello.session:
            raise ProtocolError("a Hello by another socket than the session's")
        if hello.session in self._sessions:
            return
        # otherwise the writers of the previous session would keep out the client's writers until the server
        # notices the end of that session
        replaced = self._sessions.get(hello.replaces)
        if replaced is not None:
            self._end_session(replaced)
        if len(self._sessions) >= self._max_sessions:
            self._complaints.add(
                "too many", f"more than {self._max_sessions} clients, the next are sent away"
            )
            self._send_away(socket, route, ResultCode.TOO_MANY, f"{self._max_sessions} clients are connected")
            return
        heartbeat = min(max(hello.heartbeat_ms / 1000 or self.heartbeat, MIN_HEARTBEAT), self.heartbeat)
        session = ZmqSession(
            hello.session, socket, hello.name, heartbeat, self._window, self._fail, time.monotonic
        )
        self._sessions[session.id] = session
        session.send(Welcome(self._epoch, round(heartbeat * 1000), self._window))

    def _check_sessions(self, now: float, gap: float) -> None:
        """Send heartbeats, detect dead clients and expire deliveries.

        :param gap: seconds since the last check.
        """
        stalled = gap > self.heartbeat  # this process was suspended and could not receive
        for session in tuple(self._sessions.values()):
            if stalled:
                session.last_received_s = now
            session.check_alive(now)
        self._requests.deliveries.expire(now)
        self._end_failed()

    def _fail(self, session: ZmqSession, code: ResultCode) -> None:
        """Record that a session cannot continue.

        It is ended after the current request, because callers iterate over sessions and their instances.
        """
        if not session.failed:
            session.failed = True
            self._failed.append((session, code))

    def _end_failed(self) -> None:
        while self._failed:
            session, code = self._failed.popleft()
            if self._sessions.get(session.id) is session:
                self._complaints.add(code.name, f"client {session} is given up: {code.name}")
                self._send_away(session.socket, EVENTS + session.id, code, "the session was ended")
                self._end_session(session)

    def _end_session(self, session: ZmqSession) -> None:
        """Close the instances of a session."""
        session.failed = True
        if self._sessions.pop(session.id, None) is not None:
            self._skipped += session.skipped
            self._requests.end(session)

    def _send_away(self, socket: zmq.Socket[bytes], route: bytes, code: ResultCode, text: str) -> None:
        """Notify a client that it has no session, and end an existing one."""
        session = self._sessions.get(route[1:])
        with contextlib.suppress(zmq.ZMQError):  # the client is gone, or does not read
            socket.send_multipart([EVENTS + route[1:], encode(Gone(code, text))], zmq.NOBLOCK)
        if session is not None and route[:1] == COMMANDS:
            self._end_session(session)
