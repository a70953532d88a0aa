"""The blackboard of Fawkes as seen by a client of Fawkes' network protocol."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Sequence
from functools import partial
from typing import Final

from cxbridge.blackboard.base import OpenRequest, Registry
from cxbridge.blackboard.errors import (
    BlackBoardError,
    BlackBoardGoneError,
    ForeignInstanceError,
)
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.board import RemoteBlackBoard
from cxbridge.blackboard.kit.dispatcher import Dispatcher
from cxbridge.blackboard.listeners import EventKind, ListenerTable, membership_kind
from cxbridge.clock import Clock
from cxbridge.events import EventBus
from cxbridge.interfaces.instance import Interface
from cxbridge_fawkes.network.client.connection import FawkesConnection
from cxbridge_fawkes.network.client.opener import list_interfaces, open_interface
from cxbridge_fawkes.network.client.port import UNKNOWN_SERIAL, PublicationEmitter, RemotePort
from cxbridge_fawkes.network.client.receiver import FrameReceiver
from cxbridge_fawkes.network.client.reconnecting import Reconnector
from cxbridge_fawkes.network.client.requests import EMPTY_LIST_REQUEST, RequestSender
from cxbridge_fawkes.network.messages.blackboard import (
    BoardKind,
    Close,
    InterfaceEvent,
    OpenSuccess,
    pack_data_frame,
)
from cxbridge_fawkes.network.sockets import parse_url

DEFAULT_TIMEOUT_S: Final = 5.0
"""The seconds for connecting and for replies."""

DEFAULT_SILENCE_S: Final = 5.0
"""The seconds without received data before the client probes the server."""

_CONFIRM_TIMEOUT_S: Final = 1.0  # the time for the server to receive the last messages at shutdown


class FawkesBlackBoard(RemoteBlackBoard):
    """The blackboard of Fawkes, or of another server with its protocol (docs/evidence/protocol-fawkes.md).

    A separate thread calls listeners and observers, soon after the event; only when an instance of this
    client writes or is closed, the calling thread calls the listeners of the instance. After the loss of the
    connection, the client reconnects and opens all interfaces again.

    :param url: ``fawkes://host:port``, by default port 1910.
    :param registry: returns the classes of types that are named by a string.
    :param clock: the source of the time stamps of local writes.
    :param bus: gets log lines and the writes of open interfaces.
    :param timeout: the seconds for connecting and for replies.
    :param silence: the seconds without received data before the client probes the server; 0 turns probes off.
        A server that does not reply to the probe within ``timeout`` is lost.
    :raises UnreachableError: if no server replies.
    :raises BlackBoardError: if the URL is invalid.
    """

    def __init__(
        self,
        url: str,
        registry: Registry,
        clock: Clock,
        bus: EventBus | None = None,
        *,
        timeout: float = DEFAULT_TIMEOUT_S,
        silence: float = DEFAULT_SILENCE_S,
    ) -> None:
        super().__init__(registry, clock, bus)
        self._address: Final = parse_url(url)
        self._timeout: Final = timeout
        self._lock = threading.Lock()
        self._ports_by_serial: dict[bytes, RemotePort] = {}  # the ports that are open at the server
        self._ports: dict[RemotePort, None] = {}  # in the order of opening
        self._mem_serials: dict[tuple[str, str], int] = {}  # numbers of interfaces, by type and id
        self._emitter = PublicationEmitter(bus, clock.now_us, self._list_ports)
        name = f"{self._address[0]}:{self._address[1]}"
        self._requests = RequestSender(name, timeout)
        self._dispatcher = Dispatcher("FawkesNetEvents", self.report_fault)
        self._receiver = FrameReceiver(
            self._ports_by_serial,
            self._requests,
            self._dispatcher,
            self._notify_observers,
            self._complaints,
            self._emitter,
        )
        self._reconnector = Reconnector(self, self._connect, name, silence)
        try:
            self._reconnector.start()
        except BlackBoardError:
            self._dispatcher.stop(timeout)
            raise

    def _open(self, request: OpenRequest) -> Interface:
        port: RemotePort | None = None

        # called in the receiving thread, because the next frame may be for this instance already
        def add_port(reply: OpenSuccess) -> None:
            nonlocal port
            port = RemotePort(
                self, self._requests, self._emitter, request, self._assign_mem_serial(request.key), reply
            )
            with self._lock:
                self._ports_by_serial[reply.serial.bytes] = port
                self._ports[port] = None

        open_interface(self._requests, request, add_port)
        if port is None:  # the blackboard was shut down during the request
            raise BlackBoardGoneError
        return port.instance

    def _assign_mem_serial(self, key: tuple[str, str]) -> int:
        """Return the number of an interface in this client; the reply does not have the server's number."""
        with self._lock:
            return self._mem_serials.setdefault(key, len(self._mem_serials) + 1)

    def close(self, instance: Interface) -> None:
        if not instance.valid:
            return
        port = self._find_port(instance)
        with self._lock:
            if port not in self._ports:
                return  # another thread has closed the instance
            del self._ports[port]
            serial = port.serial
            if serial is not None:
                self._ports_by_serial.pop(serial.bytes, None)
        instance.invalidate()
        # first, because the server may destroy the interface: observers learn of its end after the listeners
        port.listeners.notify(membership_kind(writer=instance.is_writer, added=False), instance.serial)
        port.listeners.unregister(None, instance)
        if serial is not None:
            with contextlib.suppress(BlackBoardError):  # a lost connection has closed the instance
                self._requests.send(Close(serial).to_bytes())

    def _shut_down(self) -> None:
        with self._lock:
            ports = tuple(self._ports)
            self._ports.clear()
            self._ports_by_serial.clear()
        for port in ports:
            port.instance.invalidate()
            port.listeners.unregister(None, port.instance)
        connection = self._requests.connection
        if connection is not None and self._requests.must_confirm and self._reconnector.is_settled:
            # Fawkes drops the unprocessed messages of a disconnected client; a reply shows that none is left
            with contextlib.suppress(BlackBoardError):
                self._requests.request(EMPTY_LIST_REQUEST, timeout=min(self._timeout, _CONFIRM_TIMEOUT_S))
        self._requests.shut_down()
        self._reconnector.stop(self._timeout)
        if connection is not None:
            connection.close_after_sending(self._timeout)
        self._dispatcher.stop(self._timeout)

    def list(self, type_glob: str = "*", id_glob: str = "*") -> Sequence[InterfaceInfo]:
        """Return the server's matching interfaces.

        :raises ConnectionLostError: if the server does not reply.
        :raises BlackBoardGoneError: after the shutdown.
        """
        return list_interfaces(self._requests, self.registry, type_glob, id_glob)

    def flush(self, timeout: float | None = None) -> None:
        """Wait until the server has received all sent frames and listeners have handled all received events.

        Within a listener, the method waits only for the server.

        :param timeout: the limit in seconds for each of the two waits; by default the client's timeout.
        :raises ConnectionLostError: if the server does not reply.
        :raises BlackBoardError: if the listeners take too long, or after the shutdown.
        """
        timeout = self._timeout if timeout is None else timeout
        # the server handles frames in order, so the reply to any request confirms all earlier frames
        self._requests.request(EMPTY_LIST_REQUEST, timeout=timeout)
        if not self._dispatcher.drain(timeout):
            raise BlackBoardError(f"listeners have been busy for {timeout:g} s")

    @property
    def connected(self) -> bool:
        """Whether the client is connected and all interfaces are open."""
        return self._reconnector.is_settled

    def _listener_table(self, instance: Interface) -> ListenerTable:
        return self._find_port(instance).listeners

    def _find_port(self, instance: Interface) -> RemotePort:
        with self._lock:
            for port in self._ports:
                if port.instance is instance:
                    return port
        raise ForeignInstanceError(instance.uid)

    def _notify_observers(self, event: InterfaceEvent) -> None:
        created = event.kind == BoardKind.INTERFACE_CREATED
        self._dispatcher.put(partial(self._observers.notify, event.type, event.id, created=created))

    def _connect(self) -> FawkesConnection:
        return FawkesConnection(
            self._address, self._timeout, self._receiver.handle, self._reconnector.report_loss
        )

    def use_connection(self, connection: FawkesConnection) -> None:
        """Send further frames over a new connection."""
        self._requests.use_connection(connection)

    def drop_connection(self, reason: str) -> None:
        """Reset the ports, fail the waiting request, and notify the listeners of lost writers."""
        with self._lock:
            self._ports_by_serial.clear()
            ports = tuple(self._ports)
        self._requests.drop_connection(reason)
        for port in ports:
            if port.lose_connection() and not port.instance.is_writer:
                self._dispatcher.put(port.listeners.notify, EventKind.WRITER_REMOVED, UNKNOWN_SERIAL)

    def probe(self) -> None:
        """Send a request to the server, and end the connection if the server does not reply.

        :raises ConnectionLostError: if the connection is lost.
        """
        self._requests.request(EMPTY_LIST_REQUEST, extend_on_data=True)

    def lost_ports(self) -> Sequence[RemotePort]:
        """Return the ports to reopen, oldest first."""
        return [port for port in self._list_ports() if port.serial is None]

    def reopen(self, port: RemotePort) -> None:
        """Open an instance again; a writer repeats its last block.

        :raises BlackBoardError: if the server refuses, or the connection is lost.
        """

        def restore_port(reply: OpenSuccess) -> None:
            with self._lock:
                if port not in self._ports:
                    return  # another thread has closed the instance during the request
                self._ports_by_serial[reply.serial.bytes] = port
            self._receiver.deliver(port, port.reopen(reply), reply.block)

        reply = open_interface(self._requests, port.request, restore_port)
        if port.serial is None:  # `restore_port` has left out the closed instance
            self._requests.send(Close(reply.serial).to_bytes())
        elif port.last_written_block is not None:
            self._requests.send(
                pack_data_frame(port.serial.bytes, port.last_written_block, changed=True), must_arrive=True
            )

    def invalidate_port(self, port: RemotePort, error: BlackBoardError) -> None:
        """Invalidate an instance that cannot be reopened."""
        with self._lock:
            self._ports.pop(port, None)
        port.instance.invalidate()
        self.warn(f"cannot open {port.uid} again; it is now invalid: {error.message}")

    def _list_ports(self) -> Sequence[RemotePort]:
        with self._lock:
            return tuple(self._ports)
