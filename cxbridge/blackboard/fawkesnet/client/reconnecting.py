"""The thread that connects a client again when its connection is lost, and opens everything again.

It asks the other end something when that has been silent for long. Other threads only report a loss to it.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from typing import Final, Protocol

from cxbridge.blackboard.errors import BlackBoardError, WriterActiveError
from cxbridge.blackboard.fawkesnet.client.connection import FawkesConnection
from cxbridge.blackboard.fawkesnet.client.port import RemotePort
from cxbridge.blackboard.fawkesnet.errors import ConnectionLostError, UnreachableError

FIRST_WAIT: Final = 0.05
"""Seconds before the second attempt; each wait is twice the one before."""
LONGEST_WAIT: Final = 1.0


class Reconnectable(Protocol):
    """A client whose connection can be made again."""

    def attach(self, connection: FawkesConnection) -> None:
        """Use this connection."""

    def detach(self, reason: str) -> None:
        """Notify all instances that the connection is lost."""

    def probe(self) -> None:
        """Ask the other end something, and end the connection when nothing comes.

        :raises ConnectionLostError: when the connection is lost.
        """

    def lost_ports(self) -> Iterable[RemotePort]:
        """Return the ports of the instances that have to be opened again."""

    def reopen(self, port: RemotePort) -> None:
        """Open an instance again.

        :raises BlackBoardError: when the remote refuses.
        """

    def give_up(self, port: RemotePort, error: BlackBoardError) -> None:
        """Make an instance invalid that cannot be opened again."""

    def announce(self, connected: bool, text: str) -> None:
        """Notify people and programs that the connection is lost or back."""


class Reconnector:
    """A thread that is at work when the connection is lost.

    :param client: whose connection it is.
    :param connect: makes a connection.
    :param name: of the other end, for people.
    :param silence: seconds of silence after which the other end is asked something; 0: never.
    """

    def __init__(
        self, client: Reconnectable, connect: Callable[[], FawkesConnection], name: str, silence: float
    ) -> None:
        self.name: Final = name
        self._silence: Final = silence
        self._client: Final = client
        self._connect: Final = connect
        self._lost = threading.Event()
        self._stopping = threading.Event()
        self._settled = threading.Event()
        self._reason = ""
        self._connection: FawkesConnection | None = None
        self._thread = threading.Thread(target=self._run, name="FawkesNetReconnector", daemon=True)

    def start(self) -> None:
        """Make the first connection.

        :raises UnreachableError: when no server answers.
        """
        self._use(self._connect())
        self._settled.set()
        self._thread.start()

    @property
    def settled(self) -> bool:
        """Whether there is a connection and all is open."""
        return self._settled.is_set() and self._connection is not None and not self._connection.ended

    def wait_settled(self, timeout: float) -> bool:
        """Wait until there is a connection and all is open; return whether it is."""
        return self._settled.wait(timeout)

    def lost(self, connection: FawkesConnection, reason: str) -> None:
        """Note, for the receiving thread, that its connection is lost."""
        if connection is self._connection and not self._stopping.is_set():
            self._reason = reason
            self._settled.clear()  # first: a check of the connection must not wait for a connection
            self._client.detach(reason)
            self._lost.set()
            self._settled.clear()

    def stop(self, timeout: float) -> None:
        """Make no connection any more and end the thread."""
        self._stopping.set()
        self._lost.set()
        if self._thread is not threading.current_thread():
            self._thread.join(timeout)

    def _use(self, connection: FawkesConnection) -> None:
        self._connection = connection
        self._client.attach(connection)
        connection.start()

    def _run(self) -> None:
        announced, pause = False, FIRST_WAIT
        while not self._stopping.is_set():
            if not self._lost.wait(self._patience()):
                self._probe()
                continue
            if self._stopping.is_set():
                return
            self._lost.clear()
            if not announced:
                self._client.announce(False, f"lost the connection to {self.name}: {self._reason}")
            else:  # there, but of no use
                self._stopping.wait(pause)
                pause = min(2 * pause, LONGEST_WAIT)
            announced = not self._come_back()
            if not announced:
                pause = FIRST_WAIT

    def _patience(self) -> float | None:
        """Return for how long there is nothing to ask."""
        if not self._silence or self._connection is None:
            return None
        return max(self._connection.last_received_s + self._silence - time.monotonic(), 0.0)

    def _probe(self) -> bool:
        """Ask the remote for a sign of life; return whether it answers.

        TCP cannot tell: the kernel acknowledges for a process that is stopped, and accepts connections to it.
        """
        try:
            self._client.probe()
        except BlackBoardError:  # the receiving thread reports it
            return False
        return True

    def _come_back(self) -> bool:
        """Connect, after longer and longer waits, and open everything; return whether that went well."""
        wait = FIRST_WAIT
        while not self._stopping.is_set() and not self._lost.is_set():
            try:
                self._use(self._connect())
                break
            except UnreachableError:
                self._stopping.wait(wait)
                wait = min(2 * wait, LONGEST_WAIT)
        wait = FIRST_WAIT
        while not self._stopping.is_set() and not self._lost.is_set():
            if self._reopen_all():
                self._settled.set()
                if self._lost.is_set():  # in this moment
                    self._settled.clear()
                    return False
                self._client.announce(True, f"the connection to {self.name} is back")
                return True
            self._stopping.wait(wait)
            wait = min(2 * wait, LONGEST_WAIT)
        return False

    def _reopen_all(self) -> bool:
        """Open the missing interfaces; return whether all are open, and no attempt has to be repeated."""
        if self._silence and not self._probe():
            return False
        complete = True
        for port in self._client.lost_ports():
            try:
                self._client.reopen(port)
            except ConnectionLostError:
                return False
            except WriterActiveError:
                complete = False  # perhaps it is us: the other end has not noticed yet that we were gone
            except BlackBoardError as error:
                self._client.give_up(port, error)
        return complete
