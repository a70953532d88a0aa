"""The commands socket of a client, for numbered frames of any thread, and the pending requests.

A ZeroMQ socket may be used by several threads under a lock, unless it is polled for input. The session's
thread attaches and detaches the socket.
"""

from __future__ import annotations

import itertools
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any, Final

import zmq

from cxbridge.blackboard.kit.errors import DisconnectedError, ProtocolError, RequestTimeoutError
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from cxbridge.blackboard.zmq.wire.frames import Credit, Frame, Request, Response, Write, encode
from cxbridge.blackboard.zmq.wire.sockets import NOBLOCK, sender

# long enough for a server that is busy, short enough for a writer that has a loop to keep
ROOM_MS: Final = 100
"""Milliseconds that a write waits for room before it is conflated."""

_PATIENCE_MS: Final = 1000  # frames that cannot be conflated wait longer; then the server counts as dead


def _make_locked() -> threading.Lock:
    """Return a locked lock, which another thread releases."""
    lock = threading.Lock()
    lock.acquire()
    return lock


@dataclass(slots=True, eq=False)
class PendingRequest:
    """A pending request.

    :param on_reply: called by the receiving thread, in the order of the stream, before `wait` returns.
    :param wake: called on a reply, for requesters that do not use `wait`.
    """

    on_reply: Callable[[Response], None] | None = None
    reply: Response | None = None
    lost: bool = False
    wake: Callable[[], None] | None = None
    _unanswered: threading.Lock = field(default_factory=_make_locked)  # an Event takes five times as long

    def finish(self, reply: Response | None) -> None:
        """Wake the requester; None means that the session was lost."""
        self.reply, self.lost = reply, reply is None
        self._unanswered.release()
        if self.wake is not None:
            self.wake()

    def answered(self) -> bool:
        """Return whether the request was answered or lost."""
        return not self._unanswered.locked()

    def wait(self, seconds: float) -> None:
        """Wait for the reply in one thread; after a timeout it may wait once more."""
        if self._unanswered.acquire(timeout=max(0.0, seconds)):
            self._unanswered.release()


class CommandSender:
    """Sends in order, from any thread, and keeps the unanswered requests.

    :param dispatcher: its thread runs urgent calls while it waits.
    """

    def __init__(self, dispatcher: EventReceiver) -> None:
        self.lock: Final = threading.RLock()
        self._changed = threading.Condition(self.lock)
        self.last_sent_s = 0.0
        """The monotonic time of the last sent frame, in seconds."""
        self.broken = False
        """Whether the server has stopped taking frames."""
        self._dispatcher: Final = dispatcher
        self._socket: zmq.Socket[bytes] | None = None
        self._send_bytes: Callable[..., Any]  # the function of the socket
        self.ready = False
        """Whether all threads may send."""
        self._closed = False
        self._number = 0
        self._requests = itertools.count(1)
        self._pending: dict[int, PendingRequest] = {}

    def attach(self, socket: zmq.Socket[bytes]) -> None:
        """Begin a session; only the session's thread may send until `set_ready`."""
        with self.lock:
            self._socket, self._number, self.broken = socket, 0, False
            self._send_bytes = sender(socket)

    def set_ready(self) -> None:
        """Let all threads send; the caller holds the lock."""
        self.ready = True
        self._changed.notify_all()

    def detach(self) -> None:
        """End the session and its pending requests."""
        with self.lock:
            self._socket, self.ready = None, False
            pending, self._pending = self._pending, {}
        for request in pending.values():
            request.finish(None)

    def close(self) -> None:
        """Release all threads that wait for a session."""
        with self.lock:
            self._closed = True
            self._changed.notify_all()

    def finish(self, reply: Response) -> bool:
        """Give a reply to its requester; return whether there is one."""
        with self.lock:
            pending = self._pending.pop(reply.request, None)
        if pending is None:
            return False
        if pending.on_reply is not None:
            try:
                pending.on_reply(reply)
            except ProtocolError:
                pending.finish(None)
                raise
        pending.finish(reply)
        return True

    def wait_ready(self, deadline: float) -> bool:
        """Wait for a session; return whether there is one."""
        with self.lock:
            while not self.ready:
                remaining = deadline - time.monotonic()
                if remaining <= 0 or self._closed:
                    return False
                self._changed.wait(remaining)
        return True

    def give_credit(self, updates: int) -> bool:
        """Report the number of handled updates; return whether it was sent."""
        return self.send(Credit(updates), wait_ms=0)

    def write(self, frame: Write, *, wait: bool) -> bool:
        """Send a write if there is a session with room; return whether it was sent."""
        with self.lock:
            return self.ready and self.send(frame, wait_ms=ROOM_MS if wait else 0)

    def send(self, frame: Frame, *, wait_ms: int = _PATIENCE_MS) -> bool:
        """Send a frame with the next number; return whether it was sent.

        :param wait_ms: milliseconds to wait for room.
        """
        # numbers and bytes go in the same order; callers that hold the lock send several frames in a row
        with self.lock:
            if self._socket is None or self.broken:
                return False
            frame.number = self._number + 1
            data = encode(frame)
            try:
                self._send_bytes(data, NOBLOCK)
            except zmq.Again:
                if not wait_ms:
                    return False
                if not self._socket.poll(wait_ms, zmq.POLLOUT):
                    self.broken = not isinstance(frame, Write)  # a lost write is replaced by the next write
                    return False
                return self.send(frame, wait_ms=0)
            except zmq.ZMQError:
                return False
            self._number += 1
            self.last_sent_s = time.monotonic()
            return True

    def start(self, frame: Request, pending: PendingRequest) -> int:
        """Send a request and return its number; the caller holds the lock.

        :raises ProtocolError: if a text has no UTF-8 form.
        """
        number = frame.request = next(self._requests)
        self._pending[number] = pending
        sent = False
        try:
            sent = self.send(frame)
        finally:
            if not sent:
                del self._pending[number]
                pending.finish(None)
        return number

    def request(
        self,
        frame: Request,
        *,
        timeout: float,
        repeat: bool = True,
        on_reply: Callable[[Response], None] | None = None,
    ) -> Response:
        """Send a request and return the reply.

        :param timeout: the limit in seconds, including the wait for a session.
        :param repeat: whether to send the request again if the session is lost before the reply; only for
            requests that may be carried out twice.
        :raises DisconnectedError: if there is no session, or it is lost.
        :raises RequestTimeoutError: if no reply comes in time.
        """
        kind = type(frame).__name__.lower()
        deadline = time.monotonic() + timeout
        in_dispatcher = self._dispatcher.is_current_thread()
        while True:
            pending = PendingRequest(on_reply, wake=self._nudge if in_dispatcher else None)
            with self.lock:
                if not self.wait_ready(deadline):
                    raise DisconnectedError("there is no connection to the blackboard's server")
                number = self.start(frame, pending)
            if in_dispatcher:
                self._dispatcher.wait(pending.answered, deadline)
            else:
                pending.wait(deadline - time.monotonic())
            with self.lock:
                given_up = self._pending.pop(number, None) is not None
            if not given_up:
                # the receiving thread has the reply and calls `on_reply`, whose effect the caller needs
                pending.wait(1.0)
            if pending.reply is not None:
                return pending.reply
            if not pending.lost:
                raise RequestTimeoutError(f"the blackboard's server did not answer in {timeout:g} s ({kind})")
            if not repeat:
                raise DisconnectedError(
                    f"the connection to the blackboard's server was lost ({kind})",
                    hint="the server may have carried out the last request",
                )

    def _nudge(self) -> None:
        """Wake the dispatcher's thread, which waits on its queue."""
        self._dispatcher.put(_do_nothing, urgent=True)


def _do_nothing() -> None:
    pass
