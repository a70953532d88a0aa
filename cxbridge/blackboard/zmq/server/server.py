"""The server of a local blackboard over ZeroMQ: sockets, sessions and their thread.

The server's thread makes posted calls, handles frames of clients and checks the sessions in turn, and sleeps
until a socket, another thread or the next check wakes the thread.
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
    COMMANDS_PREFIX,
    EVENTS_PREFIX,
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
    LINGER_MS,
    NOBLOCK,
    bind,
    is_readable,
    make_context,
    raw_receive,
    remove_file,
    skip_parts,
)
from cxbridge.rights import ALL_RIGHTS, Rights

MAX_SESSIONS: Final = 1024
"""The maximum number of clients."""

# A reader that waits for a processor core pauses about 5 ms. With 256 updates, which take 2.6 ms at 100,000
# updates a second, half of a burst was conflated.
WINDOW: Final = 1024
"""The maximum number of unacknowledged updates per client."""

_BATCH_SIZE: Final = 64  # messages of one socket before the next socket is served
_CHECKS_PER_HEARTBEAT: Final = 4  # so that a dead client is found within three heartbeats, see wire.frames


class ZmqBlackBoardServer(BoardServer, Observer):
    """Serves a local blackboard to clients in threads, processes and on other machines.

    :param board: the blackboard, which stays open.
    :param endpoints: ``tcp://host:port`` (``*`` as the port: any free port) or ``ipc://path``.
    :param heartbeat: the seconds between signs of life, of the server and of its clients.
    :param keys: the CURVE keys, required for endpoints that other machines can reach.
    :param insecure: whether such endpoints are allowed without keys.
    :param window: the maximum number of unacknowledged updates per client.
    :param max_sessions: the maximum number of clients.
    :param rights: the rights of clients, by default all.
    :raises InsecureEndpointError: if an endpoint needs keys.
    :raises EndpointError: if a text is not an endpoint.
    """

    def __init__(
        self,
        board: LocalBlackBoard,
        endpoints: Sequence[str],
        *,
        heartbeat: float = 1.0,
        keys: CurveServer | None = None,
        insecure: bool = False,
        window: int = WINDOW,
        max_sessions: int = MAX_SESSIONS,
        rights: Rights = ALL_RIGHTS,
    ) -> None:
        for endpoint in endpoints:
            check_endpoint(endpoint, has_keys=keys is not None, is_insecure_allowed=insecure)
        name = f"{COMPONENT}Server"
        super().__init__(name, None if board.bus is None else board.bus.logger(name))
        self.board: Final = board
        self.heartbeat: Final = heartbeat
        self.endpoints: list[str] = list(endpoints)
        """The endpoints, with the actual ports after the start."""
        self._keys = keys
        self._window = window
        self._max_sessions = max_sessions
        # the state of the running server
        self._context: zmq.Context[zmq.Socket[bytes]] | None = None
        self._authenticator: Any = None
        self._epoch = b""
        self._sockets: list[zmq.Socket[bytes]] = []
        self._sessions: dict[bytes, ZmqSession] = {}
        self._failed_sessions: deque[tuple[ZmqSession, ResultCode]] = deque()
        self._posted_calls: deque[tuple[Callable[..., None], tuple[Any, ...]]] = deque()

        # three heartbeats, as for the death of a client; at least a second for the client's listeners
        delivery_timeout_s = max(3 * self.heartbeat, 1.0)
        self._requests: Final = RequestHandler(
            board, self, delivery_timeout_s, partial(self._complaints.add, "request"), rights
        )

    def _prepare(self) -> None:
        """Start the authenticator, bind the sockets and observe the blackboard."""
        self._epoch = os.urandom(SERIAL_SIZE)
        self._context = make_context()
        self._authenticator = self._start_authenticator(self._context)
        for index, endpoint in enumerate(self.endpoints):
            socket, self.endpoints[index] = bind(self._context, endpoint, self._keys)
            self._sockets.append(socket)
        self.board.register_observer(self)
        if self._log is not None:
            self._log.info(f"serving at {', '.join(self.endpoints)}")

    def _start_authenticator(self, context: zmq.Context[zmq.Socket[bytes]]) -> Any:
        """Start and return the thread that checks the keys of clients; None without keys."""
        if self._keys is None:
            return None
        from zmq.auth.thread import ThreadAuthenticator  # noqa: PLC0415 - imports asyncio

        authenticator = ThreadAuthenticator(context)
        authenticator.start()
        authenticator.configure_curve(domain="*", location=self._keys.clients)
        return authenticator

    def _release(self) -> None:
        self.board.unregister_observer(self)
        # not strict: after a failed start, only the first endpoints have sockets
        for socket, endpoint in zip(self._sockets, self.endpoints, strict=False):
            remove_file(endpoint)
            with contextlib.suppress(zmq.ZMQError):  # unbinding fails without the file of an ipc endpoint
                socket.unbind(endpoint)  # releases the endpoint at once for another server
            socket.close(linger=LINGER_MS)
        self._sockets.clear()
        if self._authenticator is not None:
            self._authenticator.stop()
        if self._context is not None:
            self._context.term()

    @property
    def session_count(self) -> int:
        """The number of clients."""
        return len(self._sessions)

    def post(self, function: Callable[..., None], *args: Any) -> None:
        """Queue a call for the server's thread; calls stay in order."""
        self._posted_calls.append((function, args))
        self._wakeup.set()

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:
        """Notify the watching clients of a created or destroyed interface."""
        if self.is_current_thread():
            self._send_existence(created, interface_type, interface_id)
        else:
            self.post(self._send_existence, created, interface_type, interface_id)

    def _send_existence(self, created: bool, interface_type: str, interface_id: str) -> None:
        for session in tuple(self._sessions.values()):
            if session.is_watching:
                session.send(Existence(created, interface_type, interface_id))

    def _run(self) -> None:
        self._sockets_by_descriptor = {socket.fileno(): socket for socket in self._sockets}
        if sys.platform == "win32":
            return  # unreachable, because `make_context` refuses Windows, whose `select` has no `poll`
        poll = select.poll()
        poll.register(self._wakeup, select.POLLIN)
        for descriptor in self._sockets_by_descriptor:
            poll.register(descriptor, select.POLLIN)
        next_check_s = last_check_s = time.monotonic()
        # one message per round after a sleep, so that posted updates do not wait for a batch
        batch = 1
        ready: Sequence[tuple[int, int]] = ()
        while not self._is_stopping:
            self._wakeup.clear()
            self.run_posted_calls()
            self._end_failed()
            now_s = time.monotonic()
            if now_s >= next_check_s:
                self._check_sessions(now_s, now_s - last_check_s)
                last_check_s, next_check_s = now_s, now_s + self.heartbeat / _CHECKS_PER_HEARTBEAT
            # a descriptor of ZeroMQ reports only events since the last query or send of its socket, so
            # nothing may be sent between the query in `_receive` and the poll
            if self._receive(batch, ready):
                batch, ready = _BATCH_SIZE, ()
            else:
                batch = 1
                # a millisecond more, so that the next check is due after the poll
                ready = poll.poll(max(0.0, next_check_s - time.monotonic()) * 1000 + 1)
        for session in tuple(self._sessions.values()):
            session.send(Gone(ResultCode.SHUTDOWN, "the server stops"))
            self._end_session(session)
        self.run_posted_calls()

    def run_posted_calls(self) -> None:
        """Make the posted calls now; for the server's thread only."""
        while self._posted_calls:
            function, args = self._posted_calls.popleft()
            try:
                function(*args)
            except Exception as error:  # noqa: BLE001 - the server must serve the other clients
                self._complaints.add(type(error).__name__, f"{function.__name__} failed: {error!r}")

    def _receive(self, batch: int, ready: Sequence[tuple[int, int]]) -> bool:
        """Handle received messages, at most one batch per socket; return whether more may be waiting.

        :param ready: the descriptors and events that the poll has just reported; empty to query all sockets.
        """
        if ready:
            sockets = [
                self._sockets_by_descriptor[fd] for fd, _ in ready if fd in self._sockets_by_descriptor
            ]
        else:
            sockets = [socket for socket in self._sockets if is_readable(socket)]
        for socket in sockets:
            self._receive_from(socket, batch)
        return bool(ready or sockets)

    def _receive_from(self, socket: zmq.Socket[bytes], batch: int) -> None:
        recv = raw_receive(socket)
        for _ in range(batch):
            try:
                route = recv(NOBLOCK)
            except zmq.Again:
                return
            # a part object, which knows whether further parts follow; a query of the socket would cost more
            part = recv(0, False)
            surplus_parts = skip_parts(socket) if part.more else 0
            try:
                self._handle_message(socket, route, part.bytes, surplus_parts)
            except ProtocolError as error:
                # the kind of the complaint is the start of the text, because the end may quote the client's
                # bytes
                self._complaints.add(str(error.message)[:40], f"dropped a client: {error.message}")
                self._dismiss_client(socket, route, ResultCode.PROTOCOL, error.message)
            except Exception as error:  # noqa: BLE001 - a client's frame must not end the service of others
                self._complaints.add(type(error).__name__, f"dropped a client: {error!r}")
                self._dismiss_client(socket, route, ResultCode.REFUSED, "the server failed")

    def _handle_message(
        self, socket: zmq.Socket[bytes], route: bytes, frame_bytes: bytes, surplus_parts: int
    ) -> None:
        """Handle one message.

        :param surplus_parts: the number of parts after the frame; a valid message has none.
        """
        session = self._sessions.get(route[1:])
        if session is not None and session.has_failed:
            return
        if surplus_parts:
            raise ProtocolError(f"a message must have one frame, not {1 + surplus_parts}")
        frame = decode_client_frame(frame_bytes)
        if session is None or route[:1] != COMMANDS_PREFIX:
            if isinstance(frame, Hello):
                self._welcome(socket, route, frame)
            elif session is None:
                self._dismiss_client(socket, route, ResultCode.UNKNOWN_SESSION, "the session is unknown")
        elif self._accept_number(session, frame.number):
            if isinstance(frame, Bye):
                self._end_session(session)
            else:
                self._requests.handle(session, frame)

    def _accept_number(self, session: ZmqSession, number: int) -> bool:
        """Return whether a frame's number is the expected one, which is recorded; a gap fails the session."""
        session.last_received_s = time.monotonic()
        if number == session.last_number_received + 1:
            session.last_number_received = number
            return True
        if number > session.last_number_received:
            self._mark_failed(session, ResultCode.FRAME_LOST)
        return False

    def _welcome(self, socket: zmq.Socket[bytes], route: bytes, hello: Hello) -> None:
        """Begin a session, unless it has begun or there are too many."""
        if route != EVENTS_PREFIX + hello.session:
            raise ProtocolError("a Hello came from a socket of another session")
        if hello.session in self._sessions:
            return
        # the writers of the previous session would block the client's new writers until the server notices
        # the end of that session
        replaced_session = self._sessions.get(hello.replaces)
        if replaced_session is not None:
            self._end_session(replaced_session)
        if len(self._sessions) >= self._max_sessions:
            self._complaints.add("too many", f"refused a client: {self._max_sessions} clients are connected")
            self._dismiss_client(
                socket, route, ResultCode.TOO_MANY, f"{self._max_sessions} clients are connected"
            )
            return
        session = ZmqSession(
            hello.session, socket, hello.name, self.heartbeat, self._window, self._mark_failed, time.monotonic
        )
        self._sessions[session.id] = session
        session.send(Welcome(self._epoch, round(self.heartbeat * 1000), self._window))

    def _check_sessions(self, now_s: float, gap_s: float) -> None:
        """Send heartbeats, detect dead clients and expire deliveries.

        :param gap_s: the seconds since the last check.
        """
        was_suspended = gap_s > self.heartbeat  # the process could not receive, so no client counts as silent
        for session in tuple(self._sessions.values()):
            if was_suspended:
                session.last_received_s = now_s
            session.keep_alive(now_s)
        self._requests.deliveries.expire(now_s)
        self._end_failed()

    def _mark_failed(self, session: ZmqSession, code: ResultCode) -> None:
        """Record that a session cannot continue.

        The server's loop ends the session later, because the callers iterate over sessions and their
        instances.
        """
        if not session.has_failed:
            session.has_failed = True
            self._failed_sessions.append((session, code))

    def _end_failed(self) -> None:
        """End the sessions that cannot continue."""
        while self._failed_sessions:
            session, code = self._failed_sessions.popleft()
            if self._sessions.get(session.id) is session:
                self._complaints.add(code.name, f"dropped client {session}: {code.name}")
                self._dismiss_client(
                    session.socket, EVENTS_PREFIX + session.id, code, "the session was ended"
                )
                self._end_session(session)

    def _end_session(self, session: ZmqSession) -> None:
        """End a session and close its instances."""
        session.has_failed = True
        if self._sessions.pop(session.id, None) is not None:
            self._requests.end_session(session)

    def _dismiss_client(self, socket: zmq.Socket[bytes], route: bytes, code: ResultCode, text: str) -> None:
        """Notify a client that it has no session.

        If the route is that of a session's commands socket, the session ends.
        """
        session = self._sessions.get(route[1:])
        with contextlib.suppress(zmq.ZMQError):  # the client is lost, or does not read
            socket.send_multipart([EVENTS_PREFIX + route[1:], encode(Gone(code, text))], zmq.NOBLOCK)
        if session is not None and route[:1] == COMMANDS_PREFIX:
            self._end_session(session)
