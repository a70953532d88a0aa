"""The events socket of a client, and the thread that calls its listeners.

An event is cheapest if the receiving thread itself calls the listeners. But while listeners run, some thread
must update the copies and return credit. So two threads take turns: the dispatcher's thread receives while
its listeners are quick, and the session's thread receives otherwise. The rules:

- Only the thread that has the turn uses the socket, the numbers and the credit.

- Only the thread that has the turn gives the turn away. There is one exception: the session's thread takes
  the turn back while the dispatcher's thread calls listeners, or has not begun to receive.

- The session's thread opens and closes the socket while that thread has the turn.

- Any thread may send a nudge, an empty frame that interrupts the receiving of the dispatcher's thread, under
  a second lock.

- Any thread may queue calls, and the dispatcher's thread makes them.
"""

from __future__ import annotations

import contextlib
import queue
import threading
import time
from collections import deque
from collections.abc import Callable
from typing import Any, Final, Protocol

import zmq

from cxbridge.blackboard.kit.dispatcher import Call, Dispatcher
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire.frames import Gone, ServerFrame, Update, Welcome, decode_server_frame
from cxbridge.blackboard.zmq.wire.sockets import NOBLOCK, Context, Socket, raw_receive

MAX_WAITING_EVENTS: Final = 1024
"""The number of waiting events from which updates of one interface are conflated."""

_BATCH_SIZE: Final = 64  # frames in a row before the client returns credit
_ARRIVED_S: Final = 20e-6  # a frame that `recv` returns in less time had arrived before, so more may wait
# The client returns credit in four parts of the window, so that the server may still send three parts while
# the credit is on its way.
_CREDIT_PARTS: Final = 4

# owners of the turn to receive; plain integers, because each update compares them
_SESSION: Final = 0  # the session's thread receives
_DISPATCHER: Final = 1  # the dispatcher's thread receives
_CALLING: Final = 2  # the dispatcher's thread calls listeners; the session's thread may take the turn
# the dispatcher's thread will receive after its present call; the session's thread may take the turn
_LENT: Final = 3
_RECLAIMABLE: Final = (_CALLING, _LENT)


class FrameHandler(Protocol):
    """Handles the frames of a session, in the thread that has the turn."""

    def handle_welcome(self, epoch: bytes) -> None:
        """Reopen the instances in a new session."""

    def handle_frame(self, frame: ServerFrame) -> None:
        """Handle a frame other than an Update."""

    def handle_update(self, update: Update) -> None:
        """Handle an Update.

        :raises ProtocolError: if an earlier update is missing, or the size of the block is wrong.
        """


class EventReceiver(Dispatcher):
    """Calls listeners, and receives in turns with the session's thread.

    :param report: called with the name and error of a failed call.
    :param wake_session: wakes the session's thread, which reads `fault` and the owner of the turn.
    """

    def __init__(
        self,
        name: str,
        report: Callable[[str, Exception], None],
        context: Context,
        wake_session: Callable[[], None],
    ) -> None:
        self.context: Final = context
        self._wake_session: Final = wake_session
        self._lock: Final = threading.Lock()
        self._turn_changed: Final = threading.Condition(self._lock)
        self._turn = _SESSION
        self._is_reclaimed = False  # whether the session's thread waits in `reclaim_turn`
        self._round_count = 0  # rounds of the dispatcher's thread; a constant count shows slow listeners
        self._watched_round_count = 0  # the count at the last call of `take_turn_if_slow`
        self._nudge_lock: Final = threading.Lock()
        self._nudge_socket: Socket | None = None
        self._backlog: deque[Call | None] = deque()  # calls taken from the queue but not made yet
        self._has_ended = False
        self._is_idle = False  # whether the dispatcher's thread waits for calls
        # whether the dispatcher's thread waits for a frame, so that calls must nudge it
        self._is_receiving = False
        self.must_wake_session = False
        """Whether the dispatcher's thread must wake the session's thread before it calls listeners."""
        self._reset()
        super().__init__(name, report)  # starts the thread

    def _reset(self) -> None:
        self.last_received_s = time.monotonic()
        """The monotonic time of the last received frame or nudge, in seconds."""
        self.welcome: Welcome | None = None
        """The server's Welcome; None before its arrival."""
        self.fault = ""
        """The reason why the session cannot continue; else empty."""
        self._last_number = 0  # the number of the last received frame
        self._unreported_count = 0  # the number of handled updates that the server does not know of
        self._credit_threshold = 1  # the number of unreported updates at which the client returns credit

    def put(self, function: Callable[..., object], *args: Any, is_urgent: bool = False) -> None:
        self._queue.put((function, args, is_urgent))
        if self._is_receiving:
            self._nudge_dispatcher()

    @property
    def is_full(self) -> bool:
        """Whether the queue is so long that updates are conflated."""
        return self._queue.qsize() >= MAX_WAITING_EVENTS

    def wait_until(self, is_done: Callable[[], bool], deadline_s: float) -> None:
        """Make urgent calls until ``is_done`` returns True, for a listener that waits for a reply.

        The thread that changes the result of ``is_done`` must queue a call, which wakes this thread.

        :param deadline_s: the limit, in seconds of the monotonic clock.
        """
        self._hand_turn_over()
        while not is_done():
            remaining_s = deadline_s - time.monotonic()
            if remaining_s <= 0:
                return
            try:
                call = self._queue.get(timeout=remaining_s)
            except queue.Empty:
                return
            if call is None:  # the end of the thread, which `_call_waiting` handles
                self._queue.put(None)
                return
            _function, _args, is_urgent = call
            if is_urgent:
                # a message to a writer of this client, perhaps from the peer whose reply is missing
                self._call(*call)
            else:
                self._backlog.append(call)

    def _run(self) -> None:
        while True:
            self._call_waiting()
            if self._has_ended:
                return
            self._is_idle = True
            if self._turn == _SESSION and self._nudge_socket is not None:
                # the listeners have caught up, so the session's thread may lend the turn
                self._wake_session()
            self._backlog.append(self._queue.get())
            self._is_idle = False

    def _call_waiting(self) -> None:
        """Make all queued calls."""
        while not self._has_ended:
            if self._backlog:
                call = self._backlog.popleft()
            elif self._queue.empty():
                return
            else:
                call = self._queue.get()
            if call is None:
                self._has_ended = True
                return
            self._call(*call)

    def _receive(self) -> None:
        """Receive and call listeners until the session's thread takes over."""
        with self._lock:
            if self._turn != _LENT:
                return  # the session's thread has taken the turn back
            self._turn = _DISPATCHER
        try:
            self._receive_and_call()
        except Exception as error:  # noqa: BLE001 - for example the context was terminated
            self.fault = self.fault or repr(error)
        self._is_receiving = False
        with self._turn_changed:
            if self._turn == _DISPATCHER:
                self._turn = _SESSION
            self._turn_changed.notify_all()
        self._wake_session()

    def _receive_and_call(self) -> None:
        """Receive and make calls, one after the other, while this thread has the turn."""
        # each update of each reader passes through this loop, in a thread with cold caches, so the loop uses
        # few calls and objects
        lock, recv, now, no_calls = self._lock, self._recv, time.monotonic, self._queue.empty
        while self._turn == _DISPATCHER and not self._is_reclaimed and not self.fault:
            self._is_receiving = True  # from here on, a new call nudges this thread
            # after the flag, because a call that was queued before has not nudged this thread
            if no_calls():
                start_s = now()
                frame_bytes = recv()
                self._is_receiving = False
                self.last_received_s = end_s = now()
                self._handle_frame_bytes(frame_bytes)
                if end_s - start_s < _ARRIVED_S:
                    # before the listeners, which then read newer data
                    self.handle_waiting_frames()
                elif self._unreported_count >= self._credit_threshold:
                    self._give_credit()
            else:
                self._is_receiving = False
            if no_calls():
                continue
            self._round_count += 1
            self._turn = _CALLING
            if self._is_reclaimed:
                with self._turn_changed:
                    self._turn_changed.notify_all()
            elif self.must_wake_session:
                self._wake_session()
            self._call_waiting()
            with lock:
                if self._turn == _CALLING:
                    self._turn = _DISPATCHER

    def open_session(
        self, events: Socket, name: str, handler: FrameHandler, give_credit: Callable[[int], bool]
    ) -> None:
        """Begin a session after its Hello; the session's thread has the first turn.

        :param name: identifies the session in this process.
        :param give_credit: reports the number of handled updates to the server; returns whether
            the report was sent.
        """
        self._reset()
        self._handler = handler
        self._send_credit = give_credit
        self._recv = raw_receive(events)
        # a second peer of the socket, within the process, sends the nudges
        events.bind(f"inproc://{name}")
        nudge = self.context.socket(zmq.DEALER)
        nudge.linger = 0
        nudge.connect(f"inproc://{name}")
        with self._nudge_lock:
            self._nudge_socket = nudge

    def close_session(self) -> None:
        """End the session; the session's thread must have the turn."""
        with self._nudge_lock:
            if self._nudge_socket is not None:
                self._nudge_socket.close()
                self._nudge_socket = None

    @property
    def session_has_turn(self) -> bool:
        """Whether the session's thread receives."""
        return self._turn == _SESSION

    def lend_turn(self) -> None:
        """Let the dispatcher's thread receive if it is idle."""
        if self._is_idle and self._queue.empty():
            self._round_count += 1
            self._turn = _LENT  # not _DISPATCHER, because the thread may have begun another call
            self.put(self._receive)

    def take_turn_if_slow(self) -> bool:
        """Take the turn from the dispatcher's thread if its listeners are slow.

        :returns: whether the session's thread must call this method again soon.
        """
        round_count = self._round_count
        is_quick = round_count != self._watched_round_count
        self._watched_round_count = round_count
        if not is_quick:
            self._hand_turn_over()
        return is_quick or self._turn in _RECLAIMABLE

    def reclaim_turn(self) -> None:
        """Take the turn back, even while the dispatcher's thread receives."""
        with self._turn_changed:
            self._is_reclaimed = True
            while self._turn == _DISPATCHER:
                self._nudge_dispatcher()
                self._turn_changed.wait(1.0)  # seconds until the next nudge
            self._turn = _SESSION
            self._is_reclaimed = False

    def handle_waiting_frames(self) -> None:
        """Handle waiting frames, at most one batch."""
        # the limit, because meanwhile the client returns no credit, and its dispatcher calls no listener
        recv = self._recv
        for _ in range(_BATCH_SIZE):
            try:
                frame_bytes = recv(NOBLOCK)
            except zmq.Again:
                break
            self._handle_frame_bytes(frame_bytes)
            if self.fault:
                return
        self.last_received_s = time.monotonic()
        if self._unreported_count >= self._credit_threshold:
            self._give_credit()

    def _nudge_dispatcher(self) -> None:
        # a full queue has earlier nudges, which wake the thread
        with self._nudge_lock, contextlib.suppress(zmq.Again):
            if self._nudge_socket is not None:
                self._nudge_socket.send(b"", zmq.NOBLOCK)

    def _hand_turn_over(self) -> None:
        """Give the turn to the session's thread unless the dispatcher's thread receives."""
        with self._lock:
            if self._turn not in _RECLAIMABLE:
                return
            self._turn = _SESSION
        self._wake_session()

    def _handle_frame_bytes(self, frame_bytes: bytes) -> None:
        if not frame_bytes:
            return  # a nudge
        try:
            frame = decode_server_frame(frame_bytes)
            if type(frame) is Update:  # first, because nearly all frames are updates
                self._unreported_count += 1
                self._handler.handle_update(frame)
            else:
                self._handle_frame(frame)
        except ProtocolError as error:
            self.fail(error.message)

    def _handle_frame(self, frame: ServerFrame) -> None:
        if isinstance(frame, Gone):
            self.fault = f"the server ended the session ({frame.code.name}: {frame.text})"
            return
        if frame.number:
            if frame.number <= self._last_number:
                return  # a duplicate
            if frame.number != self._last_number + 1:
                self.fault = "frames were lost"
                return
            self._last_number = frame.number
        if isinstance(frame, Welcome):
            self.welcome = frame
            self._credit_threshold = max(1, frame.window // _CREDIT_PARTS)
            self._handler.handle_welcome(frame.epoch)
        else:
            self._handler.handle_frame(frame)

    def _give_credit(self) -> None:
        if self._send_credit(self._unreported_count):
            self._unreported_count = 0

    def fail(self, reason: str) -> None:
        """Record the first reason why the session cannot continue."""
        self.fault = self.fault or reason
