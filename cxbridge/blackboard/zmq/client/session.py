"""The thread of a client's session: it connects, sends heartbeats and reconnects.

The thread opens and closes the sockets for events and commands, which :mod:`.receiving` and :mod:`.sending`
use in between, and polls ZeroMQ's monitor socket, which reports the end of the connection. Each attempt to
connect is a session with a new id, so that the peers can tell the frames of different sessions apart.
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
    BEAT_HEARTBEATS,
    COMMANDS_PREFIX,
    DEATH_HEARTBEATS,
    EVENTS_PREFIX,
    SERIAL_SIZE,
    Beat,
    Bye,
    Hello,
    encode,
)
from cxbridge.blackboard.zmq.wire.sockets import LINGER_MS, Socket, connect

NO_REPLY: Final = "the server does not reply"
"""The reason for the end of a session whose Hello got no reply."""

# less than half of the default `connect_timeout`, so that a lost Hello leaves time for a second session
HELLO_TIMEOUT_S: Final = 2.0
"""The seconds within which the server must reply to the Hello."""

# the pause spares a server that refuses the client, for example because it has too many clients
RETRY_PAUSE_S: Final = 0.1
"""The seconds between the end of a session and the next attempt."""

# this thread receives when listeners run longer than the present patience, which doubles while they are quick
MIN_PATIENCE_MS: Final = 5
"""The patience after a slow listener, in milliseconds."""

MAX_PATIENCE_MS: Final = 40
"""The longest patience, in milliseconds."""


class SessionThread:
    """Runs sessions with the server, one after the other.

    :param url: the server's endpoint.
    :param receiver: receives in turns with this thread.
    :param wakeup: wakes this thread.
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
        name: str,
        keys: CurveClient | None,
    ) -> None:
        self._url: Final = url
        self._interfaces: Final = interfaces
        self._sender: Final = sender
        self._receiver: Final = receiver
        self._wakeup: Final = wakeup
        self._name: Final = name
        self._keys: Final = keys
        self._is_stopping = False
        self._patience_ms = MIN_PATIENCE_MS
        self._previous_session = b""  # the last id with a Welcome; the server may still keep it alive
        self._thread: Final = threading.Thread(target=self._run, name=f"BlackBoard {url}", daemon=True)

    def start(self) -> None:
        self._thread.start()

    def stop(self) -> None:
        self._is_stopping = True
        self._wakeup.set()
        if threading.current_thread() is not self._thread:
            self._thread.join()
            self._wakeup.close()

    def _run(self) -> None:
        while not self._is_stopping:
            try:
                reason = self._run_session()
            # for example without a free descriptor, which another attempt may get
            except (TransportError, zmq.ZMQError, OSError) as error:
                reason = f"cannot begin a session: {error}"
            if not self._is_stopping:
                self._interfaces.handle_loss(reason)
                self._sleep(RETRY_PAUSE_S)

    def _sleep(self, seconds: float) -> None:
        poller = zmq.Poller()
        poller.register(self._wakeup, zmq.POLLIN)
        deadline_s = time.monotonic() + seconds
        while not self._is_stopping and (remaining_s := deadline_s - time.monotonic()) > 0:
            poller.poll(int(remaining_s * 1000) + 1)
            self._wakeup.clear()

    def _run_session(self) -> str:
        """Run one session; return the reason for its end."""
        session = os.urandom(SERIAL_SIZE)
        events = connect(self._receiver.context, self._url, EVENTS_PREFIX + session, self._keys)
        try:
            commands = connect(self._receiver.context, self._url, COMMANDS_PREFIX + session, self._keys)
            try:
                monitor = events.get_monitor_socket(zmq.EVENT_DISCONNECTED)
            except zmq.ZMQError:
                commands.close(linger=0)
                raise
            self._sender.attach(commands)
            try:
                hello = Hello(
                    session,
                    replaces=self._previous_session,
                    name=self._name,
                )
                # without blocking, because a refused handshake may have closed the connection
                events.send(encode(hello), zmq.NOBLOCK)
                nudge_name = f"nudge-{session.hex()}"
                self._receiver.open_session(events, nudge_name, self._interfaces, self._sender.give_credit)
                reason = self._keep_session(events, monitor)
                if self._is_stopping and self._receiver.welcome is not None:
                    self._sender.send(Bye(), wait_ms=0)
            finally:
                # the turn first, so that no other thread uses the socket that is closed here
                self._receiver.reclaim_turn()
                self._receiver.close_session()
                self._sender.detach()
                events.disable_monitor()
                monitor.close(linger=0)
                commands.close(linger=LINGER_MS if self._is_stopping else 0)
        finally:
            events.close(linger=0)
        if self._receiver.welcome is not None:
            self._previous_session = session
        return reason

    def _keep_session(self, events: Socket, monitor: Socket) -> str:
        """Keep the session alive, and receive in this thread's turns; return the reason for the end."""
        receiver = self._receiver
        dispatcher_poller, session_poller = zmq.Poller(), zmq.Poller()
        for poller in (dispatcher_poller, session_poller):
            poller.register(self._wakeup, zmq.POLLIN)
            poller.register(monitor, zmq.POLLIN)
        session_poller.register(events, zmq.POLLIN)
        next_check_s = last_check_s = time.monotonic()
        while not (self._is_stopping or receiver.fault):
            self._wakeup.clear()  # before the states are read, so that no later change is missed
            if receiver.session_has_turn and self._sender.is_ready:
                receiver.lend_turn()
            ready = (
                dict(session_poller.poll(_ms_until(next_check_s)))
                if receiver.session_has_turn
                else self._wait_for_dispatcher(dispatcher_poller, next_check_s)
            )
            if events in ready:
                receiver.handle_waiting_frames()
            if monitor in ready:
                monitor.recv_multipart()
                # before the Welcome, ZeroMQ itself connects again, until HELLO_TIMEOUT_S
                if receiver.welcome is not None:
                    receiver.fail("the connection was closed")
            now_s = time.monotonic()
            if now_s >= next_check_s:
                self._keep_alive(now_s, now_s - last_check_s)
                # four checks in a heartbeat, see DEATH_HEARTBEATS
                last_check_s, next_check_s = now_s, now_s + self._heartbeat_s / 4
        return receiver.fault or "closed"

    def _wait_for_dispatcher(self, poller: zmq.Poller, next_check_s: float) -> dict[object, int]:
        """Wait for events while the dispatcher's thread receives."""
        if self._receiver.take_turn_if_slow():
            patience_ms, self._patience_ms = self._patience_ms, min(2 * self._patience_ms, MAX_PATIENCE_MS)
            return dict(poller.poll(min(_ms_until(next_check_s), patience_ms)))
        self._patience_ms = MIN_PATIENCE_MS
        # before the second call of `take_turn_if_slow`: listeners that start later wake this thread
        self._receiver.must_wake_session = True
        try:
            return {} if self._receiver.take_turn_if_slow() else dict(poller.poll(_ms_until(next_check_s)))
        finally:
            self._receiver.must_wake_session = False

    @property
    def _heartbeat_s(self) -> float:
        """The heartbeat of the server, or a short time until its Welcome, which the thread must soon see."""
        welcome = self._receiver.welcome
        return 0.2 if welcome is None else welcome.heartbeat_ms / 1000

    def _keep_alive(self, now_s: float, gap_s: float) -> None:
        """Send a heartbeat if it is due, and detect a dead server.

        :param gap_s: the seconds since the last check.
        """
        receiver = self._receiver
        if gap_s > self._heartbeat_s:  # the process was suspended and could not receive
            receiver.last_received_s = max(receiver.last_received_s, now_s - self._heartbeat_s)
        if receiver.welcome is None:
            if now_s - receiver.last_received_s > HELLO_TIMEOUT_S:
                receiver.fail(NO_REPLY)
            return
        if now_s - receiver.last_received_s > DEATH_HEARTBEATS * self._heartbeat_s:
            receiver.fail("the server is silent")
        elif self._sender.is_blocked:
            receiver.fail("the server no longer accepts frames")
        elif now_s - self._sender.last_sent_s > BEAT_HEARTBEATS * self._heartbeat_s:
            self._sender.send(Beat(), wait_ms=0)


def _ms_until(next_check_s: float) -> int:
    """Return the milliseconds until a monotonic time, rounded up."""
    return int(max(0.0, next_check_s - time.monotonic()) * 1000) + 1
