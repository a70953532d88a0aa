"""The commands socket of a client, for numbered frames of any thread, and the pending requests.

Several threads may use a ZeroMQ socket under a lock, unless one of them polls it for input. So commands have
a separate socket, which only sends. The session's thread attaches and detaches the socket.
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
from cxbridge.blackboard.zmq.wire.frames import Credit, Frame, Request, Response, encode
from cxbridge.blackboard.zmq.wire.sockets import NOBLOCK, raw_send

_MAX_WAIT_MS: Final = 1000  # the wait of a frame for room, after which the server counts as dead


def _make_locked_lock() -> threading.Lock:
    """Return a locked lock, which the thread with the reply releases."""
    lock = threading.Lock()
    lock.acquire()
    return lock


@dataclass(slots=True, eq=False)
class PendingRequest:
    """A request that waits for its reply.

    :param on_reply: called in the receiving thread, in the order of the frames, before `wait` returns.
    :param is_lost: whether the session was lost before the reply.
    :param wake: called after the reply, for requesters that do not use `wait`.
    """

    on_reply: Callable[[Response], None] | None = None
    reply: Response | None = None
    is_lost: bool = False
    wake: Callable[[], None] | None = None
    # a lock, because an Event takes five times as long
    _reply_lock: threading.Lock = field(default_factory=_make_locked_lock)

    def finish(self, reply: Response | None) -> None:
        """Store the reply and wake the requester.

        :param reply: the reply; None if the session was lost.
        """
        self.reply, self.is_lost = reply, reply is None
        self._reply_lock.release()
        if self.wake is not None:
            self.wake()

    def is_answered(self) -> bool:
        """Return whether the request has a reply or was lost."""
        return not self._reply_lock.locked()

    def wait(self, timeout_s: float) -> None:
        """Wait for the reply; for one thread only, which may wait again after a timeout."""
        if self._reply_lock.acquire(timeout=max(0.0, timeout_s)):
            self._reply_lock.release()


class CommandSender:
    """Sends numbered frames from any thread, and keeps the requests without reply.

    :param dispatcher: makes urgent calls while a request in its thread waits.
    """

    def __init__(self, dispatcher: EventReceiver) -> None:
        self.lock: Final = threading.RLock()
        self._readiness_changed = threading.Condition(self.lock)
        self.last_sent_s = 0.0
        """The monotonic time of the last sent frame, in seconds."""
        self.is_blocked = False
        """Whether the server has stopped accepting frames."""
        self._dispatcher: Final = dispatcher
        self._socket: zmq.Socket[bytes] | None = None
        self._send_bytes: Callable[..., Any]  # the `send` of the socket
        self.is_ready = False
        """Whether all threads may send."""
        self._is_closed = False
        self._number = 0  # of the last sent frame
        self._request_numbers = itertools.count(1)
        self._pending: dict[int, PendingRequest] = {}  # by number of the request

    def attach(self, socket: zmq.Socket[bytes]) -> None:
        """Begin a session; only the session's thread may send until `set_ready`."""
        with self.lock:
            self._socket, self._number, self.is_blocked = socket, 0, False
            self._send_bytes = raw_send(socket)

    def set_ready(self) -> None:
        """Let all threads send; the caller holds the lock."""
        self.is_ready = True
        self._readiness_changed.notify_all()

    def detach(self) -> None:
        """End the session and its pending requests."""
        with self.lock:
            self._socket, self.is_ready = None, False
            pending, self._pending = self._pending, {}
        for request in pending.values():
            request.finish(None)

    def close(self) -> None:
        """Release all threads that wait for a session."""
        with self.lock:
            self._is_closed = True
            self._readiness_changed.notify_all()

    def finish(self, reply: Response) -> bool:
        """Give a reply to its requester; return False if no request waits for the reply.

        :raises ProtocolError: if ``on_reply`` raises it: the reply is invalid.
        """
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

    def wait_ready(self, deadline_s: float) -> bool:
        """Wait until all threads may send; return False after the deadline or `close`.

        :param deadline_s: the limit, in seconds of the monotonic clock.
        """
        with self.lock:
            while not self.is_ready:
                remaining_s = deadline_s - time.monotonic()
                if remaining_s <= 0 or self._is_closed:
                    return False
                self._readiness_changed.wait(remaining_s)
        return True

    def give_credit(self, update_count: int) -> bool:
        """Report the number of handled updates; return whether the report was sent."""
        return self.send(Credit(update_count), wait_ms=0)

    def send(self, frame: Frame, *, wait_ms: int = _MAX_WAIT_MS) -> bool:
        """Send a frame with the next number; return whether the frame was sent.

        :param wait_ms: the milliseconds to wait for room.
        :raises ProtocolError: if the frame cannot be encoded.
        """
        # the lock keeps numbers and frames in the same order
        with self.lock:
            if self._socket is None or self.is_blocked:
                return False
            frame.number = self._number + 1
            frame_bytes = encode(frame)
            try:
                self._send_bytes(frame_bytes, NOBLOCK)
            except zmq.Again:
                if not wait_ms:
                    return False
                if not self._socket.poll(wait_ms, zmq.POLLOUT):
                    self.is_blocked = True
                    return False
                return self.send(frame, wait_ms=0)
            except zmq.ZMQError:
                return False
            self._number += 1
            self.last_sent_s = time.monotonic()
            return True

    def start(self, frame: Request, pending: PendingRequest) -> int:
        """Send a request and return its number; the caller holds the lock.

        A request that cannot be sent counts as lost.

        :raises ProtocolError: if the frame cannot be encoded.
        """
        number = frame.request = next(self._request_numbers)
        self._pending[number] = pending
        was_sent = False
        try:
            was_sent = self.send(frame)
        finally:
            if not was_sent:
                del self._pending[number]
                pending.finish(None)
        return number

    def request(
        self,
        frame: Request,
        *,
        timeout_s: float,
        repeat: bool = True,
        on_reply: Callable[[Response], None] | None = None,
    ) -> Response:
        """Send a request and return the reply.

        :param timeout_s: the limit in seconds, including the wait for a session.
        :param repeat: whether to send the request again if the session is lost before the reply; only for
            requests that the server may carry out twice.
        :raises DisconnectedError: if the session is missing for too long, or is lost and ``repeat`` is False.
        :raises RequestTimeoutError: if no reply comes in time.
        :raises ProtocolError: if the frame cannot be encoded.
        """
        frame_name = type(frame).__name__.lower()
        deadline_s = time.monotonic() + timeout_s
        is_in_dispatcher = self._dispatcher.is_current_thread()
        while True:
            pending = PendingRequest(on_reply, wake=self._wake_dispatcher if is_in_dispatcher else None)
            with self.lock:
                if not self.wait_ready(deadline_s):
                    raise DisconnectedError("there is no connection to the blackboard's server")
                number = self.start(frame, pending)
            if is_in_dispatcher:
                self._dispatcher.wait_until(pending.is_answered, deadline_s)
            else:
                pending.wait(deadline_s - time.monotonic())
            with self.lock:
                is_given_up = self._pending.pop(number, None) is not None
            if not is_given_up:
                # the receiving thread has the reply, but `on_reply`, whose effect the caller needs, may still
                # run; the limit is for a receiving thread that hangs
                pending.wait(1.0)
            if pending.reply is not None:
                return pending.reply
            if not pending.is_lost:
                raise RequestTimeoutError(
                    f"the blackboard's server did not reply to '{frame_name}' within {timeout_s:g} s"
                )
            if not repeat:
                raise DisconnectedError(
                    f"the connection to the blackboard's server was lost after the request '{frame_name}'",
                    hint="the server may have carried out the last request",
                )

    def _wake_dispatcher(self) -> None:
        """Wake the dispatcher's thread, which waits on its queue."""
        self._dispatcher.put(lambda: None, is_urgent=True)
