"""The thread of a client's session: it connects, sends heartbeats and reconnects.

It owns the monitor socket. It opens and closes the sockets for events and commands, which :mod:`.receiving`
and :mod:`.sending` use in between. Each attempt to connect is a session with a new id, so no frame of an
earlier session can be taken for a frame of the present one.
"""

from __future__ import annotations

import os
import threading
import time
from typing import Final

import zmq

from cxbridge.blackboard.kit.errors import TransportError
from cxbridge.blackboard.kit.wakeup import SocketWakeup
from cxbridge.blackboard.zmq.client.interfaces import OpenInterfaces
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from cxbridge.blackboard.zmq.client.sending import CommandSender
from cxbridge.blackboard.zmq.security import CurveClient
from cxbridge.blackboard.zmq.wire.frames import (
    BEAT,
    COMMANDS,
    DEATH,
    EVENTS,
    SERIAL_SIZE,
    Beat,
    Bye,
    Hello,
    encode,
)
from cxbridge.blackboard.zmq.wire.sockets import FAREWELL_MS, Socket, connect

HELLO_S: Final = 2.0
"""Seconds in which the server must answer the Hello."""

# a server that refuses, for example because it has too many clients, must not be flooded with attempts
PAUSE_S: Final = 0.1
"""Seconds between the end of a session and the next attempt."""

MIN_PATIENCE_MS: Final = 5
MAX_PATIENCE_MS: Final = 40
"""Milliseconds of running listeners after which this thread receives instead.

The minimum applies after a slow listener; it doubles up to the maximum while listeners are quick.
"""

_FLUSH_S: Final = 0.02  # seconds between attempts to send conflated updates


class SessionThread:
    """Runs sessions with the server, one after the other.

    :param url: the server's endpoint.
    :param receiver: receives in turns with this thread.
    :param wakeup: wakes this thread.
    :param heartbeat: the seconds between signs of life; the server may demand fewer.
    :param name: identifies the client in the server's log.
    """

    def __init__(
        self,
        url: str,
        interfaces: OpenInterfaces,
        sender: CommandSender,
        receiver: EventReceiver,
        wakeup: SocketWakeup,
        *,
        heartbeat: float,
        name: str,
        keys: CurveClient | None,
    ) -> None:
        self._url: Final = url
        self._interfaces: Final = interfaces
        self._sender: Final = sender
        self._receiver: Final = receiver
        self._wakeup: Final = wakeup
        self._requested_heartbeat: Final = heartbeat
        self._name: Final = name
        self._keys: Final = keys
        self._stopping = False
        self._patience = MIN_PATIENCE_MS
        self._previous = b""  # the id of the last session, which the server may not know to be dead
        self._thread: Final = threading.Thread(target=self._run, name=f"BlackBoard {url}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._stopping = True
        self._wakeup.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()
            self._wakeup.close()

    def _run(self) -> None:
        while not self._stopping:
            try:
                reason = self._session()
            # no descriptor may be left, for example, which may change
            except (TransportError, zmq.ZMQError, OSError) as error:
                reason = f"no session can begin: {error}"
            if not self._stopping:
                self._interfaces.handle_loss(reason)
                self._wait(PAUSE_S)

    def _wait(self, seconds: float) -> None:
        poller = zmq.Poller()
        poller.register(self._wakeup, zmq.POLLIN)
        deadline = time.monotonic() + seconds
        while not self._stopping and (remaining := deadline - time.monotonic()) > 0:
            poller.poll(int(remaining * 1000) + 1)
            self._wakeup.clear()

    def _session(self) -> str:
        """Run one session; return why it ended."""
        session = os.urandom(SERIAL_SIZE)
        self._interfaces.flushing = False
        events = connect(self._receiver.context, self._url, EVENTS + session, self._keys)
        try:
            commands = connect(self._receiver.context, self._url, COMMANDS + session, self._keys)
            try:
                monitor = events.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            except zmq.ZMQError:
                commands.close(linger=0)
                raise
            self._sender.attach(commands)
            try:
                hello = Hello(
                    session,
                    replaces=self._previous,
                    heartbeat_ms=round(self._requested_heartbeat * 1000),
                    name=self._name,
                )
                # without blocking, because a refused handshake may have closed the socket
                events.send(encode(hello), zmq.NOBLOCK)
                name = f"nudge-{session.hex()}"
                self._receiver.open(events, name, self._interfaces, self._sender.give_credit)
                reason = self._serve(events, monitor)
                if self._stopping and self._receiver.welcome is not None:
                    self._sender.send(Bye(), wait_ms=0)
            finally:
                # the turn first, because no other thread may use a socket that is being closed
                self._receiver.reclaim()
                self._receiver.close()
                self._sender.detach()
                events.disable_monitor()
                monitor.close(linger=0)
                commands.close(linger=FAREWELL_MS if self._stopping else 0)
        finally:
            events.close(linger=0)
        if self._receiver.welcome is not None:
            self._previous = session
        return reason

    def _serve(self, events: Socket, monitor: Socket) -> str:
        """Keep the session alive, and receive in this thread's turns; return why the session ended."""
        receiver, interfaces = self._receiver, self._interfaces
        watching, receiving = zmq.Poller(), zmq.Poller()
        for poller in (watching, receiving):
            poller.register(self._wakeup, zmq.POLLIN)
            poller.register(monitor, zmq.POLLIN)
        receiving.register(events, zmq.POLLIN)
        due = checked = time.monotonic()
        while not (self._stopping or receiver.fault):
            self._wakeup.clear()  # before the states are read, so that no change of them is missed
            if receiver.session_has_turn and self._sender.ready:
                receiver.lend()
            ready = (
                dict(receiving.poll(_ms(due))) if receiver.session_has_turn else self._watch(watching, due)
            )
            if events in ready:
                receiver.take()
            if monitor in ready:
                monitor.recv_multipart()
                if receiver.welcome is not None:
                    receiver.fail("the connection was closed")
            now = time.monotonic()
            if interfaces.flushing:
                due = min(due, now + _FLUSH_S)
            if now >= due:
                self._keep_alive(now, now - checked)
                checked, due = now, now + (_FLUSH_S if interfaces.flushing else self._heartbeat / 4)
        return receiver.fault or "closed"

    def _watch(self, poller: zmq.Poller, due: float) -> dict[object, int]:
        """Wait for events while the dispatcher's thread receives."""
        if self._receiver.watch():
            patience, self._patience = self._patience, min(2 * self._patience, MAX_PATIENCE_MS)
            return dict(poller.poll(min(_ms(due), patience)))
        self._patience = MIN_PATIENCE_MS
        self._receiver.asleep = True  # from here on this thread is woken before listeners are called
        try:
            return {} if self._receiver.watch() else dict(poller.poll(_ms(due)))
        finally:
            self._receiver.asleep = False

    @property
    def _heartbeat(self) -> float:
        """The shorter heartbeat of both peers, in seconds."""
        welcome = self._receiver.welcome
        return (
            self._requested_heartbeat
            if welcome is None
            else min(self._requested_heartbeat, welcome.heartbeat_ms / 1000)
        )

    def _keep_alive(self, now: float, gap: float) -> None:
        """Send a heartbeat if it is due, and detect a dead server.

        :param gap: seconds since the last check.
        """
        receiver = self._receiver
        if gap > self._heartbeat:  # this process was suspended and could not receive
            receiver.last_received_s = max(receiver.last_received_s, now - self._heartbeat)
        if receiver.welcome is None:
            if now - receiver.last_received_s > HELLO_S:
                receiver.fail("the server does not answer")
            return
        if now - receiver.last_received_s > DEATH * self._heartbeat:
            receiver.fail("the server is silent")
        elif self._sender.broken:
            receiver.fail("the server does not accept frames any more")
        elif now - self._sender.last_sent_s > BEAT * self._heartbeat:
            self._sender.send(Beat(), wait_ms=0)
        if self._sender.ready:
            self._interfaces.flush()


def _ms(due: float) -> int:
    """Return the milliseconds until ``due``, rounded up."""
    return int(max(0.0, due - time.monotonic()) * 1000) + 1
