"""A blackboard at a Fawkes, reached by its own network protocol."""

from __future__ import annotations

import contextlib
import itertools
import threading
from collections.abc import Sequence
from functools import partial
from typing import Final
from uuid import UUID

from cxbridge.blackboard.base import OpenRequest, Registry
from cxbridge.blackboard.errors import (
    BlackBoardError,
    BlackBoardGoneError,
    ForeignInstanceError,
)
from cxbridge.blackboard.fawkesnet.address import parse_url
from cxbridge.blackboard.fawkesnet.client.connection import FawkesConnection
from cxbridge.blackboard.fawkesnet.client.endings import Endings
from cxbridge.blackboard.fawkesnet.client.opener import Opener
from cxbridge.blackboard.fawkesnet.client.port import NOBODY, RemotePort
from cxbridge.blackboard.fawkesnet.client.receiver import FrameReceiver
from cxbridge.blackboard.fawkesnet.client.reconnecting import Reconnector
from cxbridge.blackboard.fawkesnet.client.requests import NOTHING, RequestSender
from cxbridge.blackboard.fawkesnet.client.write_events import PublicationEmitter
from cxbridge.blackboard.fawkesnet.messages.blackboard import (
    BoardKind,
    Close,
    InterfaceEvent,
    OpenSuccess,
    WireMessage,
    data_frame,
)
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.board import RemoteBlackBoard
from cxbridge.blackboard.kit.dispatcher import Dispatcher
from cxbridge.blackboard.listeners import EventKind, ListenerTable
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface, Message

DEFAULT_TIMEOUT: Final = 5.0
"""Seconds to connect, and to wait for an answer."""

DEFAULT_SILENCE: Final = 5.0
"""Seconds of silence after which the remote is asked for a sign of life."""

_LAST_WORDS_S: Final = 1.0
"""Seconds that the remote has at a shutdown to take the last messages."""


class FawkesBlackBoard(RemoteBlackBoard):
    """The blackboard of a Fawkes, or of anything that speaks its protocol (docs/evidence/protocol-fawkes.md).

    Listeners and observers are called in a thread of the blackboard's. A lost connection is made again, and
    everything is opened again.

    :param url: ``fawkes://host:port``; port 1910 unless given.
    :param registry: gives the classes of types that are named by a string.
    :param clock: gives the time stamps of local writes.
    :param bus: gets log lines, and the writes of interfaces that are open here.
    :param timeout: seconds to connect, and to wait for an answer.
    :param silence: seconds of silence after which the remote is asked for a sign of life, 0: never. Without
        an answer for ``timeout`` then, the connection is lost.
    :raises UnreachableError: when no server answers.
    """

    def __init__(
        self,
        url: str,
        registry: Registry,
        clock: Clock,
        bus: EventBus | None = None,
        *,
        timeout: float = DEFAULT_TIMEOUT,
        silence: float = DEFAULT_SILENCE,
    ) -> None:
        super().__init__(registry, clock, bus)
        self.address: Final = parse_url(url)
        self.now_us: Final = clock.now_us
        self._timeout: Final = timeout
        self._lock = threading.Lock()
        self._ports: dict[bytes, RemotePort] = {}  # by the bytes of the serial
        self._all_ports: dict[RemotePort, None] = {}
        self._mem_serials: dict[tuple[str, str], int] = {}
        self._count = itertools.count(1)
        self._emitter = PublicationEmitter(bus, clock.now_us, self._open_ports)
        self._said = False
        name = f"{self.address[0]}:{self.address[1]}"
        self._requests = RequestSender(name, timeout)
        self._opener = Opener(self._requests, name)
        self._dispatcher = Dispatcher("FawkesNetEvents", self.report_fault)
        self._endings = Endings(self._dispatcher.put)
        self._receiver = FrameReceiver(
            self._ports,
            self._requests,
            self._dispatcher,
            self._notify_observers,
            self._complaints,
            self.emit_write,
        )
        self._reconnector = Reconnector(self, self._connect, name, silence)
        try:
            self._reconnector.start()
        except BlackBoardError:
            self._dispatcher.stop(timeout)
            raise

    # -- opening and closing

    def _open(self, request: OpenRequest) -> Interface:
        port: RemotePort | None = None

        def opened(
            answer: OpenSuccess,
        ) -> None:  # in the receiving thread: what follows may be for the instance
            nonlocal port
            port = RemotePort(self, self, request, self._number(request.key), answer)
            with self._lock:
                self._ports[answer.serial.bytes] = port
                self._all_ports[port] = None

        self._opener.open(request, opened)
        if port is None:  # shut down in between
            raise BlackBoardGoneError
        return port.instance

    def _number(self, key: tuple[str, str]) -> int:
        with self._lock:
            if key not in self._mem_serials:
                self._mem_serials[key] = next(self._count)
            return self._mem_serials[key]

    def close(self, instance: Interface) -> None:
        """Close an instance; see the base class."""
        if not instance.valid:
            return
        port = self._port_of(instance)
        with self._lock:
            if self._all_ports.pop(port, self) is self:
                return  # another thread was quicker
            serial = port.serial
            if serial is not None:
                self._ports.pop(serial.bytes, None)
        instance.invalidate()
        with self._endings.closing(port.type, port.id):
            if serial is not None:
                with contextlib.suppress(BlackBoardError):  # it is closed by that
                    self._requests.send(Close(serial).to_bytes())
            kind = EventKind.WRITER_REMOVED if instance.is_writer else EventKind.READER_REMOVED
            port.listeners.notify(kind, instance.serial)
            port.listeners.unregister(None, instance)

    def _end(self) -> None:
        with self._lock:
            ports = tuple(self._all_ports)
            self._all_ports.clear()
            self._ports.clear()
        for port in ports:
            port.instance.invalidate()
            port.listeners.unregister(None, port.instance)
        connection = self._requests.connection
        if connection is not None and self._said and self._reconnector.settled:
            # Fawkes forgets the unprocessed messages of a disconnected client
            with contextlib.suppress(BlackBoardError):
                self._requests.ask(NOTHING, timeout=min(self._timeout, _LAST_WORDS_S))
        self._requests.shut_down()
        self._reconnector.stop(self._timeout)
        if connection is not None:
            connection.finish(self._timeout)
        self._dispatcher.stop(self._timeout)

    # -- looking around

    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        """Ask the remote for its interfaces; see the base class.

        :raises ConnectionLostError: when it does not answer.
        """
        return self._opener.list(self.registry, type_glob, id_glob)

    def sync(self) -> None:
        """Wait until the remote has got all that was sent, and listeners have got all that it sent before.

        In a listener it waits for the remote only.

        :raises ConnectionLostError: when the remote does not answer.
        """
        self._requests.ask(NOTHING)
        if not self._dispatcher.drain(self._timeout):
            raise BlackBoardError(f"listeners have been busy for {self._timeout:g} s")

    def flush(self, timeout: float | None = None) -> None:  # noqa: ARG002 - requests have their own
        """Wait as :meth:`sync` does; see the base class."""
        self.sync()

    @property
    def connected(self) -> bool:
        """Whether there is a connection now, and everything is open again."""
        return self._reconnector.settled

    def wait_connected(self, timeout: float) -> bool:
        """Wait until :attr:`connected`; return whether it is."""
        return self._reconnector.wait_settled(timeout)

    def _listeners_of(self, instance: Interface) -> ListenerTable:
        return self._port_of(instance).listeners

    def _port_of(self, instance: Interface) -> RemotePort:
        with self._lock:
            for port in self._all_ports:
                if port.instance is instance:
                    return port
        raise ForeignInstanceError(instance.uid)

    def _notify_observers(self, event: InterfaceEvent) -> None:
        created = event.kind == BoardKind.INTERFACE_CREATED
        notify = self._observers.created if created else self._observers.destroyed
        self._endings.deliver(event.type, event.id, partial(notify, event.type, event.id))

    # -- for ports

    def send_data(self, serial: UUID, block: bytes, *, changed: bool) -> None:
        """Send a write."""
        self._said = True
        self._requests.send(data_frame(serial.bytes, block, changed=changed))

    def send_message(self, message: WireMessage) -> None:
        """Send a message."""
        self._said = True
        self._requests.send(message.to_bytes())

    def unavailable(self) -> BlackBoardError:
        """Return the error for what needs a connection while there is none."""
        return self._requests.unavailable()

    def emit_message(self, port: RemotePort, message: Message, outcome: str) -> None:
        """Emit on the event bus what became of a message."""
        self._emitter.emit_message(port, message, outcome)

    def emit_write(self, port: RemotePort, block: bytes) -> None:
        """Emit a write on the event bus."""
        self._emitter.emit_write(port, block)

    # -- the connection, for the thread that connects again

    def _connect(self) -> FawkesConnection:
        return FawkesConnection(self.address, self._timeout, self._receiver.handle, self._reconnector.lost)

    def attach(self, connection: FawkesConnection) -> None:
        """Use this connection."""
        self._requests.attach(connection)

    def detach(self, reason: str) -> None:
        """Notify all instances that the connection is lost."""
        with self._lock:
            self._ports.clear()
            ports = tuple(self._all_ports)
        self._requests.detach(reason)
        for port in ports:
            if port.lost() and not port.instance.is_writer:
                self._dispatcher.put(port.listeners.notify, EventKind.WRITER_REMOVED, NOBODY)

    def probe(self) -> None:
        """Ask the other end something, and end the connection when nothing comes.

        :raises ConnectionLostError: when the connection is lost.
        """
        self._requests.ask(NOTHING, any_sign=True)

    def lost_ports(self) -> Sequence[RemotePort]:
        """Return the ports of the instances that have to be opened again, the oldest first."""
        return [port for port in self._open_ports() if port.serial is None]

    def reopen(self, port: RemotePort) -> None:
        """Open an instance again; a writer writes its last block again.

        :raises BlackBoardError: when the remote refuses.
        """

        def opened(answer: OpenSuccess) -> None:
            with self._lock:
                if port not in self._all_ports:
                    return  # it was closed during the request
                self._ports[answer.serial.bytes] = port
            self._receiver.deliver(port, port.reopened(answer), answer.block)

        answer = self._opener.open(port.request, opened)
        if port.serial is None:
            self._requests.send(Close(answer.serial).to_bytes())
        elif port.written is not None:
            self.send_data(port.serial, port.written, changed=True)

    def give_up(self, port: RemotePort, error: BlackBoardError) -> None:
        """Make an instance invalid that cannot be opened again."""
        with self._lock:
            self._all_ports.pop(port, None)
        port.instance.invalidate()
        self.warn(f"cannot open {port.uid} again, it is invalid now: {error.message}")

    def _open_ports(self) -> Sequence[RemotePort]:
        with self._lock:
            return tuple(self._all_ports)
