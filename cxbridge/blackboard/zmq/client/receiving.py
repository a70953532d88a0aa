"""The events socket of a client, and the thread that calls its listeners.

A listener's event costs least when the thread that received it calls the listener. But the copies are to be
kept up to date, and credit is to go back, while a listener takes its time. So two threads take turns: the
dispatcher's thread has the socket as long as its listeners are quick, the session's thread takes it when they
are not. Who owns what:

- the socket, the numbers and the credit: the thread that has the turn;
- the turn: only who has it gives it away; the session's thread takes it back only while the dispatcher's
  calls listeners, or has not begun to receive. It opens and closes the socket with the turn in hand;
- the nudge, which ends the dispatcher's receiving: any thread, by a second lock;
- the queue of calls: any thread puts, the dispatcher's takes.
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

from cxbridge.blackboard.kit.dispatcher import Dispatcher, Work
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.zmq.wire.codec import MAX_REPLY, ResultCode, decode
from cxbridge.blackboard.zmq.wire.dataframes import UPDATE, ZmqFrame, is_data_frame
from cxbridge.blackboard.zmq.wire.sockets import NOBLOCK, Context, Socket, receiver, rest

FULL: Final = 1024
"""Events that wait; beyond, updates of one interface are conflated."""

_BATCH: Final = 64
_AT_ONCE: Final = 20e-6  # seconds; a message that takes less to receive had arrived before
_RETURN: Final = 4  # credit is given back in this many parts of the window

_SESSION: Final = 0  # the session's thread receives
_DISPATCHER: Final = 1  # the dispatcher's thread receives
_CALLING: Final = 2  # so it does, but just now it calls listeners: the session's thread may take over
_LENT: Final = 3  # it will receive after the present call: the session's thread may take over
_BETWEEN: Final = (_CALLING, _LENT)


class FrameHandler(Protocol):
    """Takes the frames of a session; called in the thread that has the turn."""

    def welcomed(self, epoch: bytes) -> None:
        """Begin to open everything again."""

    def received(self, frame: ZmqFrame) -> None:
        """Take a frame."""

    def updated(self, data: bytes) -> None:
        """Take an Update, as it came.

        :raises ProtocolError: when it is none.
        """


class EventReceiver(Dispatcher):
    """Calls listeners, and receives in turns with the session's thread.

    :param name: of the thread.
    :param report: called for what fails.
    :param context: of the sockets.
    :param wake_session: makes the session's thread look at :attr:`fault`, and whose turn it is.
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
        self._turns = self._turns_seen = 0
        self._nudging: Final = threading.Lock()
        self._nudge: Socket | None = None
        self._backlog: deque[Work | None] = deque()
        self._ended = False
        self._idle = False  # the thread waits for something to call
        self._receiving = False  # it waits for the server: who hands something in has to nudge it
        self.asleep = False
        """Whether the session's thread has to be woken before listeners are called."""
        self._reset()
        super().__init__(name, report)  # begins the thread

    def _reset(self) -> None:
        self.last_received_s = time.monotonic()
        """When something was received last; seconds, monotonic."""
        self.welcome: Any = None
        """The server's Welcome; None before it came."""
        self.fault = ""
        """Why the session cannot continue."""
        self._numbers = self._credit = 0
        self._return_at = 1

    # -- the queue of calls, in any thread

    def put(self, work: Callable[..., object], *args: Any, urgent: bool = False) -> None:
        """Call ``work`` after all that was put before; see the base class."""
        self._queue.put((work, args, urgent))
        if self._receiving:
            self._nudge_dispatcher()

    @property
    def full(self) -> bool:
        """Whether the queue is so long that it is time to conflate."""
        return self._queue.qsize() >= FULL

    def wait(self, done: Callable[[], bool], deadline: float) -> None:
        """Run urgent calls until ``done``; for listeners that wait for an answer, in the thread.

        The thread that completes it puts something into the queue afterwards.
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
            if item is None:
                self._queue.put(None)
                return
            if item[2]:
                self._call(*item)
            else:
                self._backlog.append(item)

    # -- in the dispatcher's thread

    def _run(self) -> None:
        while True:
            self._call_waiting()
            if self._ended:
                return
            self._idle = True
            if self._turn == _SESSION and self._nudge is not None:
                self._wake_session()  # listeners have caught up: it may lend the turn
            self._backlog.append(self._queue.get())
            self._idle = False

    def _call_waiting(self) -> None:
        """Call all that waits."""
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
                return  # it has taken the turn back
            self._turn = _DISPATCHER
        try:
            self._take_turns()
        except Exception as error:  # noqa: BLE001 - e.g. the context was terminated
            self.fault = self.fault or repr(error)
        self._receiving = False
        with self._changed:
            if self._turn == _DISPATCHER:
                self._turn = _SESSION
            self._changed.notify_all()
        self._wake_session()

    def _take_turns(self) -> None:
        # Each update of each reader comes through here in a thread that has slept: what counts is how much
        # memory is touched, that is, few calls and few objects.
        lock, recv, now, nothing_waits = self._lock, self._recv, time.monotonic, self._queue.empty
        while self._turn == _DISPATCHER and not self._reclaimed and not self.fault:
            self._receiving = True  # from now on a new call wakes this thread
            if nothing_waits():
                before = now()
                data = recv()
                self._receiving = False
                self.last_received_s = after = now()
                self._take(data)
                if after - before < _AT_ONCE:
                    self.take()  # there may be more: the copies before the listeners
                elif self._credit >= self._return_at:
                    self._give_credit()
            else:
                self._receiving = False
            if nothing_waits():
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

    # -- the session, in the session's thread

    def open(
        self, events: Socket, name: str, handler: FrameHandler, give_credit: Callable[[int], bool]
    ) -> None:
        """Begin with a session's socket, after the Hello; the session's thread has the first turn.

        :param name: of the session, for this process.
        :param handler: takes frames.
        :param give_credit: reports to the server the number of taken updates; returns whether it could.
        """
        self._reset()
        self._handler = handler
        self._give_credit_back = give_credit
        self._events = events
        self._recv = receiver(events)
        # A thread that waits for the server is woken by an empty frame of one more peer of the socket.
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
        """Whether it is the turn of the session's thread."""
        return self._turn == _SESSION

    def lend(self) -> None:
        """Let the dispatcher's thread receive when it has nothing else to do."""
        if self._idle and self._queue.empty():
            self._turns += 1
            self._turn = _LENT  # not more: it may just have begun to call something
            self.put(self._receive)

    def watch(self) -> bool:
        """Take over the calls that the dispatcher's thread has made since the last look.

        :returns: whether to look again soon.
        """
        turns = self._turns
        quick = turns != self._turns_seen
        self._turns_seen = turns
        if not quick:
            self._hand_over()
        return quick or self._turn in _BETWEEN

    def reclaim(self) -> None:
        """Take the turn back, whatever the dispatcher's thread does."""
        with self._changed:
            self._reclaimed = True
            while self._turn == _DISPATCHER:
                self._nudge_dispatcher()
                self._changed.wait(1.0)
            self._turn = _SESSION
            self._reclaimed = False

    def take(self) -> None:
        """Take received frames, a batch at most."""
        recv = self._recv
        for _ in range(_BATCH):
            try:
                data = recv(NOBLOCK)
            except zmq.Again:
                break
            self._take(data)
            if self.fault:
                return
        self.last_received_s = time.monotonic()
        if self._credit >= self._return_at:
            self._give_credit()

    # -- the turn, in any thread

    def _nudge_dispatcher(self) -> None:
        with self._nudging, contextlib.suppress(zmq.Again):  # a thousand of them wait already
            if self._nudge is not None:
                self._nudge.send(b"", zmq.NOBLOCK)

    def _hand_over(self) -> None:
        """Let the session's thread continue, if the dispatcher's is not receiving."""
        with self._lock:
            if self._turn not in _BETWEEN:
                return
            self._turn = _SESSION
        self._wake_session()

    # -- frames, in the thread whose turn it is

    def _take(self, data: bytes) -> None:
        """Take one message, whose first frame was received."""
        try:
            if not data:
                return  # a nudge
            if data[0] == UPDATE:  # by far the most
                self._credit += 1
                self._handler.updated(data)
                return
            frames = [data] if is_data_frame(data) else [data, *rest(self._events)]
            self._take_frame(decode(frames, max_envelope=MAX_REPLY))
        except ProtocolError as error:
            self.fault = self.fault or error.message

    def _take_frame(self, frame: ZmqFrame) -> None:
        if frame.kind == "gone":
            self.fault = f"the server ended the session ({_name(frame.body.code)}: {frame.body.text})"
            return
        if frame.number:
            if frame.number <= self._numbers:
                return  # a duplicate
            if frame.number != self._numbers + 1:
                self.fault = "frames were lost"
                return
            self._numbers = frame.number
        if frame.kind == "welcome":
            self.welcome = frame.body
            self._return_at = max(1, frame.body.window // _RETURN)
            self._handler.welcomed(frame.body.epoch)
        else:
            self._handler.received(frame)

    def _give_credit(self) -> None:
        if self._give_credit_back(self._credit):
            self._credit = 0

    def fail(self, reason: str) -> None:
        """Note why the session cannot continue; the first reason counts."""
        self.fault = self.fault or reason


def _name(code: Any) -> str:
    """Return a code's name; its number when this version does not know it."""
    try:
        return ResultCode(code).name
    except ValueError:
        return str(code)
