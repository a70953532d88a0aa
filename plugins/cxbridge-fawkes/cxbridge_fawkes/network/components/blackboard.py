"""The blackboard component: a local blackboard for Fawkes' clients."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from functools import partial
from typing import ClassVar, Final
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.errors import (
    BlackBoardError,
    UnknownTypeError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.kit.complaints import Complaints
from cxbridge.blackboard.kit.server import check_client_limits
from cxbridge.blackboard.listeners import ListenerTable, Observer, listening
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import InterfaceError
from cxbridge.events import Logger
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.known_hashes import accepts_hash
from cxbridge.rights import RefusedError, Rights
from cxbridge_fawkes.network.components.opened import OpenedInstance
from cxbridge_fawkes.network.errors import MalformedMessageError
from cxbridge_fawkes.network.hashes import fawkes_hash
from cxbridge_fawkes.network.messages import blackboard as bb
from cxbridge_fawkes.network.messages.frames import ComponentId, FawkesFrame
from cxbridge_fawkes.network.session import FawkesNetworkHub, FawkesSession, NetworkHandler

OWNER: Final = "remote"
"""The owner of clients' instances, as in Fawkes."""

_MAX_SECOND: Final = 2**62  # a later time stamp of a client is implausible and not converted

_FAILURE_TEXTS: Final = {
    bb.OpenError.UNKNOWN_TYPE: "interface class not found",
    bb.OpenError.HASH_MISMATCH: "hash mismatch",
    bb.OpenError.WRITER_EXISTS: "writer already exists",
}
# the code in the reply by the class of the error; the first matching class counts
_OPEN_ERRORS: Final = (
    (UnknownTypeError, bb.OpenError.UNKNOWN_TYPE),
    (InterfaceError, bb.OpenError.UNKNOWN_TYPE),  # the definition is missing or wrong
    (WriterActiveError, bb.OpenError.WRITER_EXISTS),
    (VersionMismatchError, bb.OpenError.HASH_MISMATCH),
)


class BlackBoardNetworkHandler(NetworkHandler, Observer):
    """Opens, lists, writes and closes interfaces for clients, and forwards the events of their instances.

    The texts of most log lines are those of Fawkes.

    :param board: the blackboard that clients use.
    :param logger: logs the actions of clients.
    :param complaints: logs the mistakes of clients.
    :param rights: decides which interfaces clients may write, and which messages they may send.
    """

    COMPONENT: ClassVar[ComponentId] = ComponentId.BLACKBOARD

    def __init__(
        self,
        board: BlackBoard,
        logger: Logger,
        complaints: Complaints,
        rights: Rights,
    ) -> None:
        self._rights: Final = rights
        self._board: Final = board
        self._log: Final = logger
        self._complaints: Final = complaints
        # the instances of each client by serial
        self._instances_by_session: defaultdict[FawkesSession, dict[bytes, OpenedInstance]] = defaultdict(
            dict
        )
        self._broadcast: Callable[[bytes], None] | None = None
        self._handlers: Final[dict[int, Callable[[FawkesSession, FawkesFrame], None]]] = {
            bb.BoardKind.DATA_REFRESHED: partial(self._handle_write, changed=False),
            bb.BoardKind.DATA_CHANGED: partial(self._handle_write, changed=True),
            bb.BoardKind.INTERFACE_MESSAGE: self._handle_message,
            bb.BoardKind.OPEN_FOR_READING: self._handle_open,
            bb.BoardKind.OPEN_FOR_WRITING: self._handle_open,
            bb.BoardKind.CLOSE: self._handle_close,
            bb.BoardKind.LIST_ALL: self._handle_list,
            bb.BoardKind.LIST: self._handle_list,
        }

    def start(self, hub: FawkesNetworkHub) -> None:
        """Start reporting created and destroyed interfaces."""
        self._broadcast = hub.broadcast
        self._board.register_observer(self)

    def stop(self) -> None:
        self._board.unregister_observer(self)

    def existence_changed(self, interface_type: str, interface_id: str, *, created: bool) -> None:
        """Notify all clients of a created or destroyed interface."""
        kind = bb.BoardKind.INTERFACE_CREATED if created else bb.BoardKind.INTERFACE_DESTROYED
        if self._broadcast is not None:
            self._broadcast(bb.InterfaceEvent(kind, interface_type, interface_id).to_bytes())

    def handle(self, session: FawkesSession, frame: FawkesFrame) -> None:
        handler = self._handlers.get(frame.kind)
        if handler is None:
            raise MalformedMessageError(f"Unknown message of type {frame.kind} received")
        handler(session, frame)

    def disconnected(self, session: FawkesSession) -> None:
        """Close all instances of a client."""
        for opened_instance in self._instances_by_session.pop(session, {}).values():
            uid = opened_instance.instance.uid
            self._log.debug(f"Closing interface {uid} of remote {session.number} (client disconnected)")
            self._close_instance(opened_instance)

    def _handle_open(self, session: FawkesSession, frame: FawkesFrame) -> None:
        error_code = bb.OpenError.UNKNOWN
        try:
            request = bb.Open.unpack(frame.payload, writing=frame.kind == bb.BoardKind.OPEN_FOR_WRITING)
            self._log.debug(f"Remote opens interface {request.type}::{request.id}")
            self._try_open(session, request)
        except (BlackBoardError, InterfaceError, RefusedError) as error:
            error_code = next(
                (code for error_class, code in _OPEN_ERRORS if isinstance(error, error_class)), error_code
            )
            session.send(bb.OpenFailure(error_code).to_bytes())  # the client waits for a reply
            if error_code is bb.OpenError.UNKNOWN:
                raise
            self._complaints.add(
                f"open {error_code} {session.peer}",
                f"Opening interface {request.type}::{request.id} failed, {_FAILURE_TEXTS[error_code]}",
            )

    def _try_open(self, session: FawkesSession, request: bb.Open) -> None:
        """Open an interface for a client.

        :raises CxbridgeError: if the interface cannot be opened.
        """
        if request.writing:
            self._rights.check_writer(f"{request.type}::{request.id}")
        interface_class = self._board.registry.get(request.type)
        schema, client_instances = interface_class.SCHEMA, self._instances_by_session[session]
        if not accepts_hash(schema, request.hash):
            # before the opening, which would create the interface
            raise VersionMismatchError(f"{request.type}::{request.id}", schema.hash, request.hash)
        check_client_limits(
            (opened_instance.instance for opened_instance in client_instances.values()), schema
        )
        opened_instance = self._open_listening(session, interface_class, request)
        if request.writing:
            opened_instance.instance.auto_timestamping = False  # the client sets the time stamps
        client_instances[opened_instance.instance.serial.bytes] = opened_instance
        session.max_block_size = max(session.max_block_size, _find_max_block_size(interface_class))
        opened_instance.announce()

    def _open_listening(
        self, session: FawkesSession, interface_class: type[Interface], request: bb.Open
    ) -> OpenedInstance:
        opened_instances: list[OpenedInstance] = []

        # called by the board during the opening, so that the client misses no event
        def listen(instance: Interface, listeners: ListenerTable) -> None:
            opened_instances.append(OpenedInstance(instance, session, self._board.clock.now_us))
            listening(opened_instances[0])(instance, listeners)

        open_interface = self._board.open_for_writing if request.writing else self._board.open_for_reading
        open_interface(interface_class, request.id, owner=OWNER, listen=listen)
        return opened_instances[0]

    def _handle_close(self, session: FawkesSession, frame: FawkesFrame) -> None:
        serial = bb.Close.unpack(frame.payload).serial
        opened_instance = self._instances_by_session[session].pop(serial.bytes, None)
        if opened_instance is None:
            raise BlackBoardError(
                f"Client {session.number} tried to close interface with serial {serial} "
                "which has not been opened"
            )
        self._log.debug(f"Remote {session.number} closing interface {opened_instance.instance.uid}")
        self._close_instance(opened_instance)

    def _close_instance(self, opened_instance: OpenedInstance) -> None:
        self._board.unregister_listener(opened_instance, opened_instance.instance)
        self._board.close(opened_instance.instance)

    def _handle_list(self, session: FawkesSession, frame: FawkesFrame) -> None:
        type_glob = id_glob = "*"
        if frame.kind == bb.BoardKind.LIST:
            request = bb.ListMatching.unpack(frame.payload)
            type_glob, id_glob = request.type_pattern, request.id_pattern
        registry = self._board.registry
        listed_interfaces = (
            bb.ListedInterface(
                type=info.type,
                id=info.id,
                hash=fawkes_hash(registry, info.type, info.hash),
                number=info.serial,
                has_writer=info.has_writer,
                num_readers=info.num_readers,
                timestamp_us=info.timestamp_us,
            )
            for info in self._board.list(type_glob, id_glob)
        )
        session.send(bb.InterfaceList(tuple(listed_interfaces)).to_bytes())

    def _handle_write(self, session: FawkesSession, frame: FawkesFrame, *, changed: bool) -> None:
        serial, block = bb.unpack_data(frame.payload)
        instance = self._find_instance(session, serial, "DATA")
        if not instance.is_writer:
            raise BlackBoardError(f"DATA: {session!r} writes to {instance.uid}, which it reads, ignoring.")
        if len(block) != instance.SCHEMA.datasize:
            raise BlackBoardError(
                f"DATA: Data size mismatch, expected {instance.SCHEMA.datasize}, "
                f"but got {len(block)}, ignoring."
            )
        instance.set_from_chunk(block)
        if changed:
            _mark_changed(instance, block)
        instance.write()  # keeps the client's time stamp

    def _handle_message(self, session: FawkesSession, frame: FawkesFrame) -> None:
        wire_message = bb.WireMessage.unpack(frame.payload)
        instance = self._find_instance(session, wire_message.serial.bytes, "MESSAGE")
        if instance.is_writer:
            raise BlackBoardError(
                "MESSAGE: Received message notification, but for a writing instance, ignoring."
            )
        message = instance.create_message(wire_message.type)
        if len(wire_message.block) != message.SCHEMA.datasize:
            raise BlackBoardError(
                f"MESSAGE: Data size mismatch, expected {message.SCHEMA.datasize}, "
                f"but got {len(wire_message.block)}, ignoring."
            )
        self._rights.check_message(instance.type, message.type)
        message.set_from_chunk(wire_message.block)
        message.address(wire_message.id, instance.mem_serial, instance.serial, wire_message.source)
        message.mark_foreign(wire_message.hops)
        self._log.debug(
            f"Processing message from sender {instance.serial}, source {wire_message.source}, "
            f"mm source {wire_message.source}"
        )
        instance.msgq_enqueue(message, proxy=True, message_id=wire_message.id)

    def _find_instance(self, session: FawkesSession, serial: bytes, operation: str) -> Interface:
        opened_instance = self._instances_by_session[session].get(serial)
        if opened_instance is None:
            raise BlackBoardError(
                f"{operation}: Interface with serial {UUID(bytes=serial)} not found, ignoring."
            )
        return opened_instance.instance


def _mark_changed(instance: Interface, block: bytes) -> None:
    """Mark the values as changed, and the time stamp as new even if the client's clock stands still."""
    seconds, microseconds = STAMP.unpack_from(block)
    if 0 <= seconds <= _MAX_SECOND and 0 <= microseconds < MICROSECONDS:
        instance.set_timestamp(seconds * MICROSECONDS + microseconds)
    else:
        instance.mark_data_changed()


def _find_max_block_size(interface_class: type[Interface]) -> int:
    """Return the size of the largest block of an interface and its messages."""
    schema = interface_class.SCHEMA
    return max([schema.datasize, *(message.datasize for message in schema.messages)])
