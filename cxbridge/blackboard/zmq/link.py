"""A client's thread for its session: connects, receives, keeps alive, and begins anew when it is lost."""

from __future__ import annotations

import os
import threading
import time
from typing import Any, Final, Protocol

import zmq

from cxbridge.blackboard.zmq.codec import MAX_REPLY, SESSION_SIZE, Code, Frame, decode, encode
from cxbridge.blackboard.zmq.errors import ProtocolError
from cxbridge.blackboard.zmq.outbox import Outbox
from cxbridge.blackboard.zmq.security import CurveClient
from cxbridge.blackboard.zmq.sessions import BEAT, COMMANDS, DEATH, EVENTS
from cxbridge.blackboard.zmq.sockets import FAREWELL_MS, connect, readable
from cxbridge.blackboard.zmq.wakeup import Wakeup

HELLO_S: Final = 2.0
"""How long an attempt to begin a session may take."""

PAUSE_S: Final = 0.1
"""Between attempts, when the server said no."""

_BATCH: Final = 64
_FLUSH_S: Final = 0.02  # between attempts to send what was conflated
_RETURN: Final = 4  # credit is given back in so many parts of the window


class Receiver(Protocol):
    """Whose link it is; everything is called in the link's thread."""

    def welcomed(self, epoch: bytes) -> None:
        """Begin to open everything again; call :meth:`Link.ready` when it is done."""

    def received(self, frame: Frame) -> bool:
        """Take a frame; return whether it was an update, which costs credit."""

    def lost(self, reason: str) -> None:
        """Note that the session is lost."""

    def flush(self) -> bool:
        """Send what was conflated; return whether there is more."""


class Link:
    """The session of a client.

    :param url: the server's endpoint.
    :param receiver: takes what comes.
    :param outbox: sends.
    :param heartbeat: seconds, as the client wishes; the server may want a shorter one.
    :param name: of the client, for the server's log.
    """

    def __init__(
        self,
        url: str,
        receiver: Receiver,
        outbox: Outbox,
        context: zmq.Context[zmq.Socket[bytes]],
        *,
        heartbeat: float,
        name: str,
        keys: CurveClient | None,
    ) -> None:
        self._url = url
        self._receiver = receiver
        self._outbox = outbox
        self._context = context
        self._wish = self._heartbeat = heartbeat
        self._name = name
        self._keys = keys
        self._wakeup = Wakeup()
        self._stopping = False
        self._before = b""
        self._thread = threading.Thread(target=self._run, name=f"BlackBoard {url}", daemon=True)
        self._reset()

    def _reset(self) -> None:
        self._heard = time.monotonic()
        self._welcomed = self._flushing = False
        self._numbers = self._credit = self._window = 0
        self._fault = ""

    def start(self) -> None:
        """Begin to connect."""
        self._thread.start()

    def stop(self) -> None:
        """Say goodbye and end the thread."""
        self._stopping = True
        self._wakeup.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()
            self._wakeup.close()

    def hurry(self) -> None:
        """Let the thread soon try to send what was conflated."""
        if not self._flushing:
            self._flushing = True
            self._wakeup.set()

    # -- the thread

    def _run(self) -> None:
        while not self._stopping:
            reason = self._session()
            if not self._stopping:
                self._receiver.lost(reason)
                self._wait(PAUSE_S)

    def _wait(self, seconds: float) -> None:
        poller = zmq.Poller()
        poller.register(self._wakeup.fd, zmq.POLLIN)
        until = time.monotonic() + seconds
        while not self._stopping and (left := until - time.monotonic()) > 0:
            poller.poll(int(left * 1000) + 1)
            self._wakeup.clear()

    def _session(self) -> str:
        """Have one session from its beginning to its end; return why it ended."""
        session = os.urandom(SESSION_SIZE)
        self._reset()
        self._heartbeat = self._wish
        events = connect(self._context, self._url, EVENTS + session, self._keys)
        try:
            commands = connect(self._context, self._url, COMMANDS + session, self._keys)
            monitor = events.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            self._outbox.attach(commands)
            try:
                hello = {
                    "session": session,
                    "replaces": self._before,
                    "heartbeat_ms": round(self._wish * 1000),
                    "name": self._name,
                }
                events.send(encode("hello", 0, hello))
                reason = self._serve(events, monitor)
                if self._stopping and self._welcomed:
                    self._outbox.send("bye", {}, wait_ms=0)
            finally:
                self._outbox.detach()
                events.disable_monitor()
                monitor.close(linger=0)
                commands.close(linger=FAREWELL_MS if self._stopping else 0)
        finally:
            events.close(linger=0)
        if self._welcomed:
            self._before = session
        return reason

    def _serve(self, events: zmq.Socket[bytes], monitor: zmq.Socket[bytes]) -> str:
        """Take what comes until the session ends; return why."""
        poller = zmq.Poller()
        for waited in (self._wakeup.fd, events, monitor):
            poller.register(waited, zmq.POLLIN)
        last = time.monotonic()
        due = last
        while not self._stopping:
            ready = [socket for socket, _ in poller.poll(int(max(0.0, due - time.monotonic()) * 1000) + 1)]
            if self._wakeup.fd in ready:
                self._wakeup.clear()
            if events in ready:
                self._receive(events)
            if monitor in ready:
                monitor.recv_multipart()
                if self._welcomed:
                    self._fault = self._fault or "the connection was closed"
            now = time.monotonic()
            if self._flushing:
                due = min(due, now + _FLUSH_S)
            if not self._fault and now >= due:
                self._look_after(now, now - last)
                last, due = now, now + (_FLUSH_S if self._flushing else self._heartbeat / 4)
            if self._fault:
                return self._fault
        return "closed"

    def _receive(self, events: zmq.Socket[bytes]) -> None:
        for _ in range(_BATCH):
            frames = events.recv_multipart()
            try:
                self._take(decode(frames, max_envelope=MAX_REPLY))
            except ProtocolError as error:
                self._fault = error.message
            if self._fault or not readable(events):  # cheaper than an exception
                break
        if self._window and self._credit * _RETURN >= self._window:
            self._give_credit()

    def _take(self, frame: Frame) -> None:
        self._heard = time.monotonic()
        if frame.kind == "gone":
            self._fault = f"the server ended the session ({_name(frame.body.code)}: {frame.body.text})"
            return
        if frame.number:
            if frame.number <= self._numbers:
                return  # a duplicate
            if frame.number != self._numbers + 1:
                self._fault = "frames were lost"
                return
            self._numbers = frame.number
        if frame.kind == "welcome":
            self._welcomed = True
            self._heartbeat = min(self._wish, frame.body.heartbeat_ms / 1000)
            self._window = max(1, frame.body.window)
            self._receiver.welcomed(frame.body.epoch)
        elif self._receiver.received(frame):
            self._credit += 1

    def _give_credit(self) -> None:
        if self._outbox.send("credit", {"count": self._credit}, wait_ms=0):
            self._credit = 0

    def _look_after(self, now: float, gap: float) -> None:
        """Send a heartbeat when it is due; find out whether the server is dead."""
        if gap > self._heartbeat:  # this process stood still: nothing could be heard
            self._heard = max(self._heard, now - self._heartbeat)
        if not self._welcomed:
            if now - self._heard > HELLO_S:
                self._fault = "the server does not answer"
            return
        if now - self._heard > DEATH * self._heartbeat:
            self._fault = "the server is silent"
        elif self._outbox.broken:
            self._fault = "the server takes nothing any more"
        elif now - self._outbox.sent > BEAT * self._heartbeat:
            self._outbox.send("beat", {}, wait_ms=0)
        if self._outbox.ready:
            self._flushing = self._receiver.flush()

    def fail(self, reason: str) -> None:
        """End the session; in the link's thread."""
        self._fault = self._fault or reason


def _name(code: Any) -> str:
    """Return a code's name; its number when this version does not know it."""
    try:
        return Code(code).name
    except ValueError:
        return str(code)
