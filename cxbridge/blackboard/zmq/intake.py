"""What a client hears in a session: frame by frame, by the one of its two threads whose turn it is.

A listener's event costs least when the thread that received it calls the listener. But the copies are to be
kept up to date, and credit is to go back, while a listener takes its time. So the dispatcher's thread has the
socket as long as its listeners are quick, and the link's thread takes it when they are not.
"""

from __future__ import annotations

import contextlib
import threading
import time
from collections.abc import Callable
from typing import Any, Final, Protocol

import zmq

from cxbridge.blackboard.zmq.codec import MAX_REPLY, Code, decode
from cxbridge.blackboard.zmq.dataframes import UPDATE, Frame, is_data_frame
from cxbridge.blackboard.zmq.dispatcher import Dispatcher
from cxbridge.blackboard.zmq.errors import ProtocolError
from cxbridge.blackboard.zmq.outbox import Outbox
from cxbridge.blackboard.zmq.sockets import NOBLOCK, Context, Socket, receiver, rest

_BATCH: Final = 64
_AT_ONCE: Final = 20e-6  # seconds; what takes less to receive was there before
_RETURN: Final = 4  # credit is given back in so many parts of the window


class Receiver(Protocol):
    """Who takes what comes; called in the thread whose turn it is."""

    def welcomed(self, epoch: bytes) -> None:
        """Begin to open everything again."""

    def received(self, frame: Frame) -> None:
        """Take a frame."""

    def updated(self, data: bytes) -> None:
        """Take an Update, as it came.

        :raises ProtocolError: when it is none.
        """


_LINK: Final = 0  # the link's thread receives
_DISPATCHER: Final = 1  # the dispatcher's thread receives
_CALLING: Final = 2  # so it does, but just now it calls listeners: the link's thread may take over
_LENT: Final = 3  # so it will, when it has called what it is just calling: the link's thread may take over
_BETWEEN: Final = (_CALLING, _LENT)


class Intake:
    """The socket for events, who reads it, and what the session is as far as it can be heard.

    :param receiver: takes what comes.
    :param outbox: gives credit back.
    :param dispatcher: calls listeners.
    :param wake_link: makes the link's thread look at :attr:`fault`, and whose turn it is.
    """

    def __init__(
        self,
        context: Context,
        receiver: Receiver,
        outbox: Outbox,
        dispatcher: Dispatcher,
        wake_link: Callable[[], None],
    ) -> None:
        self._context = context
        self._receiver = receiver
        self._outbox = outbox
        self._dispatcher = dispatcher
        self._wake_link = wake_link
        self._lock = threading.Lock()
        self._changed = threading.Condition(self._lock)
        self._turn = _LINK
        self._reclaimed = False
        self._turns = self._turns_seen = 0
        self._nudging = threading.Lock()
        self._nudge: Socket | None = None
        self.asleep = False
        """Whether the link's thread has to be woken before listeners are called."""
        dispatcher.wake = self._wake_dispatcher
        dispatcher.on_idle = self._offer
        dispatcher.stop_receiving = self._hand_over
        self._reset()

    def _reset(self) -> None:
        self.heard = time.monotonic()
        """When something was heard last; seconds, monotonic."""
        self.welcome: Any = None
        """The server's Welcome; None before it came."""
        self.fault = ""
        """Why the session cannot go on."""
        self._numbers = self._credit = 0
        self._return_at = 1

    # -- the session, in the link's thread

    def open(self, events: Socket, name: str) -> None:
        """Begin with a session's socket, after the Hello; the link's thread has the first turn.

        :param name: of the session, for this process.
        """
        self._reset()
        self._events = events
        self._recv = receiver(events)
        # A thread that waits for the server is woken by an empty frame of one more peer of the socket.
        events.bind(f"inproc://{name}")
        nudge = self._context.socket(zmq.DEALER)
        nudge.linger = 0
        nudge.connect(f"inproc://{name}")
        with self._nudging:
            self._nudge = nudge

    def close(self) -> None:
        """End the session; the link's thread must have the turn."""
        with self._nudging:
            if self._nudge is not None:
                self._nudge.close()
                self._nudge = None

    @property
    def mine(self) -> bool:
        """Whether it is the turn of the link's thread."""
        return self._turn == _LINK

    def lend(self) -> None:
        """Let the dispatcher's thread receive when it has nothing else to do."""
        if self._dispatcher.idle and self._dispatcher.nothing_waits():
            self._turns += 1
            self._turn = _LENT  # not more: it may just have begun to call something
            self._dispatcher.put(self._receive)

    def watch(self) -> bool:
        """Take over from what the dispatcher's thread has called since the last look.

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
                self._wake_dispatcher()
                self._changed.wait(1.0)
            self._turn = _LINK
            self._reclaimed = False

    def take(self) -> None:
        """Take what has come in, not more than a batch."""
        recv = self._recv
        for _ in range(_BATCH):
            try:
                data = recv(NOBLOCK)
            except zmq.Again:
                break
            self._take(data)
            if self.fault:
                return
        self.heard = time.monotonic()
        if self._credit >= self._return_at:
            self._give_credit()

    # -- in any thread

    def _wake_dispatcher(self) -> None:
        with self._nudging, contextlib.suppress(zmq.Again):  # a thousand of them wait already
            if self._nudge is not None:
                self._nudge.send(b"", zmq.NOBLOCK)

    def _hand_over(self) -> None:
        """Let the link's thread go on, if the dispatcher's is not receiving."""
        with self._lock:
            if self._turn not in _BETWEEN:
                return
            self._turn = _LINK
        self._wake_link()

    # -- in the dispatcher's thread

    def _offer(self) -> None:
        """Let the link's thread know that listeners have caught up."""
        if self._turn == _LINK and self._nudge is not None:
            self._wake_link()

    def _receive(self) -> None:
        """Receive and call listeners until the link's thread takes over."""
        with self._lock:
            if self._turn != _LENT:
                return  # it has taken the turn back
            self._turn = _DISPATCHER
        try:
            self._take_turns()
        except Exception as error:  # noqa: BLE001 - e.g. the context was terminated
            self.fault = self.fault or repr(error)
        self._dispatcher.receiving = False
        with self._changed:
            if self._turn == _DISPATCHER:
                self._turn = _LINK
            self._changed.notify_all()
        self._wake_link()

    def _take_turns(self) -> None:
        # Each update of each reader comes through here in a thread that has slept: what counts is how much
        # memory is touched, that is, few calls and few objects.
        dispatcher, lock, recv, now = self._dispatcher, self._lock, self._recv, time.monotonic
        nothing_waits = dispatcher.nothing_waits
        while self._turn == _DISPATCHER and not self._reclaimed and not self.fault:
            dispatcher.receiving = True  # from now on those who hand something in wake this thread
            if nothing_waits():
                before = now()
                data = recv()
                dispatcher.receiving = False
                self.heard = after = now()
                self._take(data)
                if after - before < _AT_ONCE:
                    self.take()  # there may be more: the copies before the listeners
                elif self._credit >= self._return_at:
                    self._give_credit()
            else:
                dispatcher.receiving = False
            if nothing_waits():
                continue
            self._turns += 1
            self._turn = _CALLING
            if self._reclaimed:
                with self._changed:
                    self._changed.notify_all()
            elif self.asleep:
                self._wake_link()
            dispatcher.call_waiting()
            with lock:
                if self._turn == _CALLING:
                    self._turn = _DISPATCHER

    # -- frames, in the thread whose turn it is

    def _take(self, data: bytes) -> None:
        """Take one message, whose first frame was received."""
        try:
            if not data:
                return  # a nudge
            if data[0] == UPDATE:  # by far the most
                self._credit += 1
                self._receiver.updated(data)
                return
            frames = [data] if is_data_frame(data) else [data, *rest(self._events)]
            self._take_frame(decode(frames, max_envelope=MAX_REPLY))
        except ProtocolError as error:
            self.fault = self.fault or error.message

    def _take_frame(self, frame: Frame) -> None:
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
            self._receiver.welcomed(frame.body.epoch)
        else:
            self._receiver.received(frame)

    def _give_credit(self) -> None:
        if self._outbox.give_credit(self._credit):
            self._credit = 0

    def fail(self, reason: str) -> None:
        """Note why the session cannot go on; the first reason counts."""
        self.fault = self.fault or reason


def _name(code: Any) -> str:
    """Return a code's name; its number when this version does not know it."""
    try:
        return Code(code).name
    except ValueError:
        return str(code)
