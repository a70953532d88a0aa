"""Handling of received frames in the receiving thread."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.dispatcher import Dispatcher
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.listeners import EventKind
from cxbridge.blackboard.port import make_received_message
from cxbridge.blackboard.publications import HANDLED, QUEUED, REFUSED
from cxbridge.errors import InterfaceError
from cxbridge.interfaces.instance import Interface
from cxbridge_fawkes.network.client.port import (
    MAX_WAITING_EVENTS,
    DataEvents,
    PublicationEmitter,
    RemotePort,
)
from cxbridge_fawkes.network.client.requests import RequestSender
from cxbridge_fawkes.network.messages import codec
from cxbridge_fawkes.network.messages.blackboard import (
    BlackBoardMessage,
    BoardKind,
    InstanceEvent,
    InterfaceEvent,
    InterfaceList,
    OpenFailure,
    OpenSuccess,
    WireMessage,
    unpack_data,
)
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame

_DATA_KINDS: Final = frozenset((int(BoardKind.DATA_REFRESHED), int(BoardKind.DATA_CHANGED)))


class FrameReceiver:
    """Stores data in ports, hands replies to waiting requests, and queues events for the dispatcher.

    :param ports: the ports by the bytes of their serials; the board changes the mapping.
    :param requests: has the request that waits for a reply.
    :param dispatcher: calls the listeners.
    :param notify_observers: called with created and destroyed interfaces.
    :param complaints: logs invalid messages.
    :param emitter: emits received data and messages on the event bus.
    """

    def __init__(
        self,
        ports: Mapping[bytes, RemotePort],
        requests: RequestSender,
        dispatcher: Dispatcher,
        notify_observers: Callable[[InterfaceEvent], None],
        complaints: Complaints,
        emitter: PublicationEmitter,
    ) -> None:
        self._ports: Final = ports
        self._requests: Final = requests
        self._dispatcher: Final = dispatcher
        self._notify_observers: Final = notify_observers
        self._complaints: Final = complaints
        self._emitter: Final = emitter

    def handle(self, frame: FawkesFrame) -> None:
        """Handle a received frame."""
        if frame.component != ComponentId.BLACKBOARD:
            return  # this client sends no requests to other components
        try:
            if frame.kind in _DATA_KINDS:
                self._handle_data(frame)
            else:
                self._handle_message(codec.decode(frame))
        except ProtocolError as error:
            self._complaints.add(
                f"malformed {frame.kind}", f"ignored an invalid message of the Fawkes server: {error.message}"
            )

    def _handle_data(self, frame: FawkesFrame) -> None:
        serial, block = unpack_data(frame.payload)
        port = self._ports.get(serial)
        if port is None:
            return  # the instance has been closed
        if len(block) != port.interface_class.SCHEMA.datasize:
            self._complaints.add(
                f"size {port.uid}", f"ignored data of {port.uid}: {len(block)} bytes instead of {port.size}"
            )
            return
        self.deliver(port, port.receive(block, changed=frame.kind == BoardKind.DATA_CHANGED), block)

    def deliver(self, port: RemotePort, events: DataEvents, block: bytes) -> None:
        """Emit a new block on the bus, and queue the data events of listeners."""
        # DATA_CHANGED alone belongs to the block of the frame before
        if any(kind is EventKind.DATA_REFRESHED for kind, _ in events):
            self._emitter.emit_write(port, block)
        # a dropped event is harmless: listeners read the newest data at the waiting events
        if any(audience for _, audience in events) and port.waiting_event_count < MAX_WAITING_EVENTS:
            port.waiting_event_count += 1
            self._dispatcher.put(_notify_data, port, events)

    def _handle_message(self, message: BlackBoardMessage) -> None:
        match message:
            case InterfaceList() | OpenSuccess() | OpenFailure():
                if not self._requests.handle_reply(message):
                    self._complaints.add("answer", "ignored a reply without a request")
            case InstanceEvent():
                self._handle_instance_event(message)
            case InterfaceEvent():
                self._notify_observers(message)
            case WireMessage():
                self._handle_interface_message(message)
            case _:
                self._complaints.add("direction", "ignored a message that only clients send")

    def _handle_instance_event(self, event: InstanceEvent) -> None:
        port = self._ports.get(event.serial.bytes)
        if port is not None:
            kind = EventKind[event.kind.name]  # both have Fawkes' names READER_ADDED to WRITER_REMOVED
            port.count_instance(kind)
            self._dispatcher.put(port.listeners.notify, kind, event.event_serial)

    def _handle_interface_message(self, message: WireMessage) -> None:
        port = self._ports.get(message.serial.bytes)
        if port is None:
            return
        if not port.instance.is_writer:
            self._complaints.add(
                "reader", f"ignored a message to {port.uid}, which this client has open only for reading"
            )
            return
        self._dispatcher.put(self._enqueue, port, port.instance, message)

    def _enqueue(self, port: RemotePort, writer: Interface, wire_message: WireMessage) -> None:
        """Append a message to the writer's queue, unless a listener handles the message.

        Called in the thread of the dispatcher.
        """
        try:
            message = make_received_message(
                writer,
                wire_message.type,
                wire_message.block,
                message_id=wire_message.id,
                sender=wire_message.source,  # the wire has only the first sender, not the last
                source=wire_message.source,
                hops=wire_message.hops + 1,
            )
            try:
                port.deliver(writer, message)
            except BlackBoardError:
                self._emitter.emit_message(port, message, REFUSED)
                raise
            self._emitter.emit_message(port, message, QUEUED if message.enqueued else HANDLED)
        except (BlackBoardError, InterfaceError) as error:
            self._complaints.add(f"message {port.uid}", f"lost a message to {port.uid}: {error.message}")


def _notify_data(port: RemotePort, events: DataEvents) -> None:
    """Notify listeners of data events, in the thread of the dispatcher."""
    port.waiting_event_count -= 1
    for kind, audience in events:
        port.listeners.notify_audience(audience, kind)
