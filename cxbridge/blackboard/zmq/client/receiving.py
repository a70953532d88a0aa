"""The events socket of a client, and the thread that calls its listeners.

An event is cheapest when the receiving thread calls the listeners. While listeners run, however, the copies
must be updated and credit must be returned. Two threads therefore take turns: the dispatcher's thread
receives while its listeners are quick, otherwise the session's thread. Owners:

- the socket, the numbers and the credit belong to the thread that has the turn;

- the turn is given away only by its owner. The session's thread takes it back only while the dispatcher's
  thread calls listeners, or has not begun to receive. It opens and closes the socket while it has the turn;

- the nudge, which interrupts the dispatcher's receiving, is for any thread, under a second lock;

- the queue of calls is filled by any thread and emptied by the dispatcher's thread.
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
from cxbridge.blackboard.zmq.wire.sockets import NOBLOCK, Context, Socket, receiver

MAX_WAITING_EVENTS: Final = 1024
"""The number of waiting events above which updates of one interface are conflated."""

_BATCH: Final = 64  # frames in a row, before credit is returned
_AT_ONCE: Final = 20e-6  # seconds; a frame that is received in less time had arrived before
# Credit is returned in four parts of the window, so that the server may still send three parts while the
# credit is on its way.
_CREDIT_PARTS: Final = 4

# owners of the turn to receive; integers, because they are compared for each update
_SESSION: Final = 0  # the session's thread receives
_DISPATCHER: Final = 1  # the dispatcher's thread receives
_CALLING: Final = 2  # the dispatcher's thread calls listeners: the session's thread may take over
# the dispatcher's thread receives after the present call: the session's thread may take over
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
    :param context: the ZeroMQ context.
    :param wake_session: makes the session's thread look at `fault` and at the turn.
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
        self._changed: Final = threading.Condition(self._lock)
        self._turn = _SESSION
        self._reclaimed = False
        self._turns = 0  # rounds of the dispatcher's thread, which show whether listeners are quick
        self._watched_turns = 0  # the rounds at the last call of `watch`
        self._nudging: Final = threading.Lock()
        self._nudge: Socket | None = None
        self._backlog: deque[Call | None] = deque()  # calls taken from the queue while a listener waited
        self._ended = False
        self._idle = False  # the thread waits for calls
        self._receiving = False  # the thread waits for the server, so a new call has to nudge it
        self.asleep = False
        """Whether the session's thread must be woken before listeners are called."""
        self._reset()
        super().__init__(name, report)  # starts the thread

    def _reset(self) -> None:
        self.last_received_s = time.monotonic()
        """The monotonic time of the last received frame, in seconds."""
        self.welcome: Welcome | None = None
        """The server's Welcome, None before it."""
        self.fault = ""
        """Why the session cannot continue."""
        self._last_number = 0  # the number of the last received frame
        self._credit = 0  # the number of handled updates that the server does not know
        self._return_at = 1

    def put(self, work: Callable[..., object], *args: Any, urgent: bool = False) -> None:
        self._queue.put((work, args, urgent))
        if self._receiving:
            self._nudge_dispatcher()

    @property
    def full(self) -> bool:
        """Whether the queue is so long that updates are conflated."""
        return self._queue.qsize() >= MAX_WAITING_EVENTS

    def wait(self, done: Callable[[], bool], deadline: float) -> None:
        """Run urgent calls until ``done``, for listeners that wait for a reply in this thread.

        The thread that completes ``done`` must then queue a call, which ends the wait.
        """
        self._hand_over()
        while not done():
            remaining = deadline - time.monotonic()
            if remaining <= 0:
                return
            try:
                item = self._queue.get(timeout=remaining)
            except queue.Empty:
                return
            if item is None:  # the end, which is for `_call_waiting`
                self._queue.put(None)
                return
            _work, _args, urgent = item
            if urgent:  # a message for a writer of this client, whose sender may be the peer that is to reply
                self._call(*item)
            else:
                self._backlog.append(item)

    def _run(self) -> None:
        while True:
            self._call_waiting()
            if self._ended:
                return
            self._idle = True
            if self._turn == _SESSION and self._nudge is not None:
                # the listeners have caught up, so the session's thread may lend the turn
                self._wake_session()
            self._backlog.append(self._queue.get())
            self._idle = False

    def _call_waiting(self) -> None:
        """Make all queued calls."""
        while not self._ended:
            if self._backlog:
                item = self._backlog.popleft()
            elif self._queue.empty():
                return
            else:
                item = self._queue.get()
            if item is None:
                self._ended = True
                return
            self._call(*item)

    def _receive(self) -> None:
        """Receive and call listeners until the session's thread takes over."""
        with self._lock:
            if self._turn != _LENT:
                return  # the session's thread has taken the turn back
            self._turn = _DISPATCHER
        try:
            self._take_turns()
        except Exception as error:  # noqa: BLE001 - for example the context was terminated
            self.fault = self.fault or repr(error)
        self._receiving = False
        with self._changed:
            if self._turn == _DISPATCHER:
                self._turn = _SESSION
            self._changed.notify_all()
        self._wake_session()

    def _take_turns(self) -> None:
        """Receive and make calls, one after the other, while this thread has the turn."""
        # every update of every reader passes here, in a thread with cold caches: use few calls and few
        # objects
        lock, recv, now, no_calls = self._lock, self._recv, time.monotonic, self._queue.empty
        while self._turn == _DISPATCHER and not self._reclaimed and not self.fault:
            self._receiving = True  # a new call wakes the thread from here on
            # after the flag: a call that was queued before it has not nudged this thread
            if no_calls():
                start_s = now()
                data = recv()
                self._receiving = False
                self.last_received_s = end_s = now()
                self._handle_message(data)
                if end_s - start_s < _AT_ONCE:
                    self.take()  # update the copies by all waiting frames before calling listeners
                elif self._credit >= self._return_at:
                    self._give_credit()
            else:
                self._receiving = False
            if no_calls():
                continue
            self._turns += 1
            self._turn = _CALLING
            if self._reclaimed:
                with self._changed:
                    self._changed.notify_all()
            elif self.asleep:
                self._wake_session()
            self._call_waiting()
            with lock:
                if self._turn == _CALLING:
                    self._turn = _DISPATCHER

    def open(
        self, events: Socket, name: str, handler: FrameHandler, give_credit: Callable[[int], bool]
    ) -> None:
        """Begin a session after its Hello; the session's thread has the first turn.

        :param name: identifies the session in this process.
        :param give_credit: reports the number of handled updates to the server; returns whether it was sent.
        """
        self._reset()
        self._handler = handler
        self._give_credit_back = give_credit
        self._recv = receiver(events)
        # an empty frame of another peer of the socket wakes a thread that waits for the server
        events.bind(f"inproc://{name}")
        nudge = self.context.socket(zmq.DEALER)
        nudge.linger = 0
        nudge.connect(f"inproc://{name}")
        with self._nudging:
            self._nudge = nudge

    def close(self) -> None:
        """End the session; the session's thread must have the turn."""
        with self._nudging:
            if self._nudge is not None:
                self._nudge.close()
                self._nudge = None

    @property
    def session_has_turn(self) -> bool:
        """Whether the session's thread receives."""
        return self._turn == _SESSION

    def lend(self) -> None:
        """Let the dispatcher's thread receive if it is idle."""
        if self._idle and self._queue.empty():
            self._turns += 1
            self._turn = _LENT  # only lent, because the thread may just have begun a call
            self.put(self._receive)

    def watch(self) -> bool:
        """Take over from the dispatcher's thread if its listeners are slow.

        :returns: whether to look again soon.
        """
        turns = self._turns
        quick = turns != self._watched_turns
        self._watched_turns = turns
        if not quick:
            self._hand_over()
        return quick or self._turn in _RECLAIMABLE

    def reclaim(self) -> None:
        """Take the turn back, even from a receiving thread."""
        with self._changed:
            self._reclaimed = True
            while self._turn == _DISPATCHER:
                self._nudge_dispatcher()
                self._changed.wait(1.0)
            self._turn = _SESSION
            self._reclaimed = False

    def take(self) -> None:
        """Handle waiting frames, at most one batch."""
        # at most, because a fast writer could keep the thread here, without returned credit
        recv = self._recv
        for _ in range(_BATCH):
            try:
                data = recv(NOBLOCK)
            except zmq.Again:
                break
            self._handle_message(data)
            if self.fault:
                return
        self.last_received_s = time.monotonic()
        if self._credit >= self._return_at:
            self._give_credit()

    def _nudge_dispatcher(self) -> None:
        # with a full queue of nudges the thread wakes up anyway
        with self._nudging, contextlib.suppress(zmq.Again):
            if self._nudge is not None:
                self._nudge.send(b"", zmq.NOBLOCK)

    def _hand_over(self) -> None:
        """Give the turn to the session's thread unless the dispatcher's thread receives."""
        with self._lock:
            if self._turn not in _RECLAIMABLE:
                return
            self._turn = _SESSION
        self._wake_session()

    def _handle_message(self, data: bytes) -> None:
        if not data:
            return  # a nudge
        try:
            frame = decode_server_frame(data)
            if type(frame) is Update:  # first, because nearly all frames are updates
                self._credit += 1
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
            self._return_at = max(1, frame.window // _CREDIT_PARTS)
            self._handler.handle_welcome(frame.epoch)
        else:
            self._handler.handle_frame(frame)

    def _give_credit(self) -> None:
        if self._give_credit_back(self._credit):
            self._credit = 0

    def fail(self, reason: str) -> None:
        """Record why the session cannot continue; later reasons are ignored."""
        self.fault = self.fault or reason
