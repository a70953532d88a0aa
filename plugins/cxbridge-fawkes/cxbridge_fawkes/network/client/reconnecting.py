"""The thread that reconnects a client and reopens its interfaces.

The thread also probes a silent server. The receiving thread only reports the loss of the connection.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from typing import Final, Protocol

from cxbridge.blackboard.errors import BlackBoardError, WriterActiveError
from cxbridge_fawkes.network.client.connection import FawkesConnection
from cxbridge_fawkes.network.client.port import RemotePort
from cxbridge_fawkes.network.errors import ConnectionLostError, UnreachableError

# short, because a restarted Fawkes is back within a second; doubled, because an absent server may stay absent
FIRST_WAIT_S: Final = 0.05
"""The seconds before the second attempt. Each further wait is twice as long, up to `MAX_WAIT_S`."""
MAX_WAIT_S: Final = 1.0
"""The maximal wait between attempts in seconds."""


class Reconnectable(Protocol):
    """A client whose connection can be replaced, :class:`~.board.FawkesBlackBoard`."""

    def use_connection(self, connection: FawkesConnection) -> None:
        """Send further frames over a new connection."""

    def drop_connection(self, reason: str) -> None:
        """Reset the ports, fail the waiting request, and notify the listeners of lost writers."""

    def probe(self) -> None:
        """Send a request to the server, and end the connection if the server does not reply.

        :raises ConnectionLostError: if the connection is lost.
        """

    def lost_ports(self) -> Iterable[RemotePort]:
        """Return the ports to reopen."""

    def reopen(self, port: RemotePort) -> None:
        """Open an instance again.

        :raises BlackBoardError: if the server refuses, or the connection is lost.
        """

    def invalidate_port(self, port: RemotePort, error: BlackBoardError) -> None:
        """Invalidate an instance that cannot be reopened."""

    def report_connection(self, connected: bool, text: str) -> None:
        """Log the loss or return of the connection and queue the callbacks."""


class Reconnector:
    """Restores lost connections and probes a silent server, in a thread.

    :param connect: returns a new connection to the server, which is not started yet.
    :param name: the server's name, for log lines.
    :param silence: the seconds without received data before a probe; 0 turns probes off.
    """

    def __init__(
        self, client: Reconnectable, connect: Callable[[], FawkesConnection], name: str, silence: float
    ) -> None:
        self.name: Final = name
        self._silence_s: Final = silence
        self._client: Final = client
        self._connect: Final = connect
        self._loss_reported = threading.Event()
        self._stopping = threading.Event()
        self._settled = threading.Event()
        self._loss_reason = ""
        self._connection: FawkesConnection | None = None
        self._thread = threading.Thread(target=self._run, name="FawkesNetReconnector", daemon=True)

    def start(self) -> None:
        """Make the first connection.

        :raises UnreachableError: if no server replies.
        """
        self._use_connection(self._connect())
        self._settled.set()
        self._thread.start()

    @property
    def is_settled(self) -> bool:
        """Whether the client is connected, and each interface was reopened or refused by the server."""
        return self._settled.is_set() and self._connection is not None and not self._connection.has_ended

    def report_loss(self, connection: FawkesConnection, reason: str) -> None:
        """Report a lost connection. Called in the receiving thread."""
        if connection is self._connection and not self._stopping.is_set():
            self._loss_reason = reason
            self._settled.clear()  # first, so that a caller that checks `is_settled` sends no request
            self._client.drop_connection(reason)
            self._loss_reported.set()
            self._settled.clear()  # again, because `_restore` may have set the event before this loss

    def stop(self, timeout: float) -> None:
        """Stop reconnecting and end the thread."""
        self._stopping.set()
        self._loss_reported.set()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout)

    def _use_connection(self, connection: FawkesConnection) -> None:
        self._connection = connection
        self._client.use_connection(connection)
        connection.start()

    def _run(self) -> None:
        is_loss_announced, wait_s = False, FIRST_WAIT_S
        while not self._stopping.is_set():
            if not self._loss_reported.wait(self._probe_wait_s()):
                self._probe()
                continue
            if self._stopping.is_set():
                return
            self._loss_reported.clear()
            if not is_loss_announced:
                self._client.report_connection(
                    False, f"lost the connection to {self.name}: {self._loss_reason}"
                )
            else:  # the new connection was lost, too, before all interfaces were open
                self._stopping.wait(wait_s)
                wait_s = min(2 * wait_s, MAX_WAIT_S)
            is_loss_announced = not self._restore()
            if not is_loss_announced:
                wait_s = FIRST_WAIT_S

    def _probe_wait_s(self) -> float | None:
        """Return the seconds until the next probe; None to wait for a loss only."""
        if not self._silence_s or self._connection is None:
            return None
        return max(self._connection.last_received_s + self._silence_s - time.monotonic(), 0.0)

    def _probe(self) -> bool:
        """Probe the server; return whether it replies."""
        # TCP keep-alive is not enough: the kernel acknowledges data and accepts connections for a stopped
        # process
        try:
            self._client.probe()
        except BlackBoardError:
            return False  # the receiving thread reports the loss
        return True

    def _restore(self) -> bool:
        """Connect and open all interfaces; return whether the client has succeeded."""
        if not self._retry(self._reconnect) or not self._retry(self._reopen_all):
            return False
        self._settled.set()
        if self._loss_reported.is_set():  # the new connection was lost in the meantime
            self._settled.clear()
            return False
        self._client.report_connection(True, f"the connection to {self.name} is back")
        return True

    def _retry(self, attempt: Callable[[], bool]) -> bool:
        """Repeat an attempt with increasing waits until it succeeds.

        :returns: False if the client stops, or the new connection is lost.
        """
        wait_s = FIRST_WAIT_S
        while not self._stopping.is_set() and not self._loss_reported.is_set():
            if attempt():
                return True
            self._stopping.wait(wait_s)
            wait_s = min(2 * wait_s, MAX_WAIT_S)
        return False

    def _reconnect(self) -> bool:
        try:
            self._use_connection(self._connect())
        except UnreachableError:
            return False
        return True

    def _reopen_all(self) -> bool:
        """Reopen the lost instances; return False if the attempt must be repeated."""
        # the kernel also accepts a connection for a stopped process, and a client without instances sends no
        # other request
        if self._silence_s and not self._probe():
            return False
        is_complete = True
        for port in self._client.lost_ports():
            try:
                self._client.reopen(port)
            except ConnectionLostError:
                return False
            except WriterActiveError:
                # perhaps this client's former instance, if the server has not noticed the lost connection yet
                is_complete = False
            except BlackBoardError as error:
                self._client.invalidate_port(port, error)
        return is_complete
