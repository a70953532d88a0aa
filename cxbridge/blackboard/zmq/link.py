"""A client's thread for its session: connects, keeps alive, and begins again when it is lost."""

from __future__ import annotations

import os
import threading
import time
from typing import Final, Protocol

import zmq

from cxbridge.blackboard.zmq.codec import SESSION_SIZE, encode
from cxbridge.blackboard.zmq.dispatcher import Dispatcher
from cxbridge.blackboard.zmq.errors import TransportError
from cxbridge.blackboard.zmq.intake import Intake
from cxbridge.blackboard.zmq.intake import Receiver as IntakeReceiver
from cxbridge.blackboard.zmq.outbox import Outbox
from cxbridge.blackboard.zmq.security import CurveClient
from cxbridge.blackboard.zmq.sessions import BEAT, COMMANDS, DEATH, EVENTS
from cxbridge.blackboard.zmq.sockets import FAREWELL_MS, Context, Socket, connect
from cxbridge.blackboard.zmq.wakeup import Wakeup

HELLO_S: Final = 2.0
"""How long an attempt to begin a session may take."""

PAUSE_S: Final = 0.1
"""Between attempts, when the server said no."""

PATIENCE_MS: Final = (5, 40)
"""How long listeners may run before this thread receives in the place of theirs; the longer they have been
quick, the later it looks."""

_FLUSH_S: Final = 0.02  # between attempts to send what was conflated


class Receiver(IntakeReceiver, Protocol):
    """Whose link it is."""

    def lost(self, reason: str) -> None:
        """Note that the session is lost; in the link's thread."""

    def flush(self) -> bool:
        """Send what was conflated; return whether there is more. In the link's thread."""


class Link:
    """The session of a client.

    :param url: the server's endpoint.
    :param receiver: takes what comes.
    :param outbox: sends.
    :param dispatcher: calls listeners.
    :param heartbeat: seconds, as the client wishes; the server may want a shorter one.
    :param name: of the client, for the server's log.
    """

    def __init__(
        self,
        url: str,
        receiver: Receiver,
        outbox: Outbox,
        dispatcher: Dispatcher,
        context: Context,
        *,
        heartbeat: float,
        name: str,
        keys: CurveClient | None,
    ) -> None:
        self._url = url
        self._receiver = receiver
        self._outbox = outbox
        self._context = context
        self._wish = heartbeat
        self._name = name
        self._keys = keys
        self._wakeup = Wakeup()
        self._stopping = self._flushing = False
        self._patience = PATIENCE_MS[0]
        self._before = b""
        self.intake: Final = Intake(context, receiver, outbox, dispatcher, self._wakeup.set)
        self._thread = threading.Thread(target=self._run, name=f"BlackBoard {url}", daemon=True)

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
            try:
                reason = self._session()
            except (
                TransportError,
                zmq.ZMQError,
                OSError,
            ) as error:  # no descriptor is left, for example: there will be
                reason = f"no session can begin: {error}"
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
        self._flushing = False
        events = connect(self._context, self._url, EVENTS + session, self._keys)
        try:
            commands = connect(self._context, self._url, COMMANDS + session, self._keys)
            try:
                monitor = events.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            except zmq.ZMQError:
                commands.close(linger=0)
                raise
            self._outbox.attach(commands)
            try:
                hello = {
                    "session": session,
                    "replaces": self._before,
                    "heartbeat_ms": round(self._wish * 1000),
                    "name": self._name,
                }
                events.send(encode("hello", 0, hello), zmq.NOBLOCK)  # a refused handshake may have ended it
                self.intake.open(events, f"nudge-{session.hex()}")
                reason = self._serve(events, monitor)
                if self._stopping and self.intake.welcome is not None:
                    self._outbox.send("bye", {}, wait_ms=0)
            finally:
                self.intake.reclaim()
                self.intake.close()
                self._outbox.detach()
                events.disable_monitor()
                monitor.close(linger=0)
                commands.close(linger=FAREWELL_MS if self._stopping else 0)
        finally:
            events.close(linger=0)
        if self.intake.welcome is not None:
            self._before = session
        return reason

    def _serve(self, events: Socket, monitor: Socket) -> str:
        """Look after the session, and receive when it is this thread's turn; return why it ended."""
        intake = self.intake
        watching, receiving = zmq.Poller(), zmq.Poller()
        for poller in (watching, receiving):
            poller.register(self._wakeup.fd, zmq.POLLIN)
            poller.register(monitor, zmq.POLLIN)
        receiving.register(events, zmq.POLLIN)
        due = last = time.monotonic()
        while not (self._stopping or intake.fault):
            self._wakeup.clear()
            if intake.mine and self._outbox.ready:
                intake.lend()
            ready = dict(receiving.poll(_ms(due))) if intake.mine else self._watch(watching, due)
            if events in ready:
                intake.take()
            if monitor in ready:
                monitor.recv_multipart()
                if intake.welcome is not None:
                    intake.fail("the connection was closed")
            now = time.monotonic()
            if self._flushing:
                due = min(due, now + _FLUSH_S)
            if now >= due:
                self._look_after(now, now - last)
                last, due = now, now + (_FLUSH_S if self._flushing else self._heartbeat / 4)
        return intake.fault or "closed"

    def _watch(self, poller: zmq.Poller, due: float) -> dict[object, int]:
        """Wait for something to do while the dispatcher's thread receives."""
        if self.intake.watch():
            patience, self._patience = self._patience, min(2 * self._patience, PATIENCE_MS[1])
            return dict(poller.poll(min(_ms(due), patience)))
        self._patience = PATIENCE_MS[0]
        self.intake.asleep = True  # from now on this thread is woken when listeners are called
        try:
            return {} if self.intake.watch() else dict(poller.poll(_ms(due)))
        finally:
            self.intake.asleep = False

    @property
    def _heartbeat(self) -> float:
        """Seconds; the shorter one of both sides."""
        welcome = self.intake.welcome
        return self._wish if welcome is None else min(self._wish, welcome.heartbeat_ms / 1000)

    def _look_after(self, now: float, gap: float) -> None:
        """Send a heartbeat when it is due; find out whether the server is dead."""
        intake = self.intake
        if gap > self._heartbeat:  # this process stood still: nothing could be heard
            intake.heard = max(intake.heard, now - self._heartbeat)
        if intake.welcome is None:
            if now - intake.heard > HELLO_S:
                intake.fail("the server does not answer")
            return
        if now - intake.heard > DEATH * self._heartbeat:
            intake.fail("the server is silent")
        elif self._outbox.broken:
            intake.fail("the server takes nothing any more")
        elif now - self._outbox.sent > BEAT * self._heartbeat:
            self._outbox.send("beat", {}, wait_ms=0)
        if self._outbox.ready:
            self._flushing = self._receiver.flush()


def _ms(due: float) -> int:
    """Return how many milliseconds there are until then."""
    return int(max(0.0, due - time.monotonic()) * 1000) + 1
