"""The blackboard component: a local blackboard for Fawkes' clients."""

from __future__ import annotations

import threading
from collections.abc import Callable
from typing import ClassVar, Final
from uuid import UUID

from cxbridge.blackboard.base import BlackBoard
from cxbridge.blackboard.errors import (
    BlackBoardError,
    UnknownTypeError,
    VersionMismatchError,
    WriterActiveError,
)
from cxbridge.blackboard.fawkesnet import bb_messages as bb
from cxbridge.blackboard.fawkesnet.complaints import Complaints
from cxbridge.blackboard.fawkesnet.components.base import ServerComponent
from cxbridge.blackboard.fawkesnet.errors import MalformedMessageError
from cxbridge.blackboard.fawkesnet.frames import Component, Frame
from cxbridge.blackboard.fawkesnet.hashes import hash_to_tell
from cxbridge.blackboard.fawkesnet.session import Hub, Session
from cxbridge.blackboard.listeners import EventKind, Listener
from cxbridge.blackboard.observers import Observer
from cxbridge.clock import MICROSECONDS
from cxbridge.errors import InterfaceError
from cxbridge.events import Logger
from cxbridge.interfaces.instance import STAMP, Interface, Message
from cxbridge.interfaces.known_hashes import accepts_hash

OWNER: Final = "remote"
"""Who owns what clients open, as in Fawkes."""
MOST_INSTANCES: Final = 1024
"""Instances that one client may have open."""

_LAST_SECOND: Final = 2**62
"""Time stamps beyond are nonsense from the wire, and left as they are."""

_INSTANCE_EVENTS: Final = (
    EventKind.READER_ADDED,
    EventKind.READER_REMOVED,
    EventKind.WRITER_ADDED,
    EventKind.WRITER_REMOVED,
)
_FAILURES: Final = {
    bb.OpenError.UNKNOWN_TYPE: "interface class not found",
    bb.OpenError.HASH_MISMATCH: "hash mismatch",
    bb.OpenError.WRITER_EXISTS: "writer already exists",
}


class _Opened(Listener):
    """An instance that a client has open; tells the client what happens to it.

    Nothing is told before the client knows the instance: what happens until then is in OPEN_SUCCESS.
    """

    def __init__(self, instance: Interface, session: Session, now_us: Callable[[], int]) -> None:
        self.instance: Final = instance
        self._now_us: Final = now_us
        self.session: Final = session
        self._serial: Final = instance.serial.bytes
        self._lock = threading.Lock()
        self._known = False

    def introduce(self) -> None:
        """Tell the client of the instance."""
        with self._lock:
            instance = self.instance
            instance.read()
            block = instance.to_bytes()
            opened = bb.OpenSuccess(instance.serial, instance.has_writer, instance.num_readers, block)
            self.session.send(opened.to_bytes())
            self._known = True

    def data_refreshed(self, interface: Interface) -> None:
        self._send_data(interface, changed=False)

    def data_changed(self, interface: Interface) -> None:
        self._send_data(interface, changed=True)

    def _send_data(self, interface: Interface, *, changed: bool) -> None:
        with self._lock:
            if self._known:
                interface.read()
                self.session.send_data(self._serial, interface.to_bytes(), changed=changed)

    def message_received(self, interface: Interface, message: Message) -> bool:
        source = message.source_id or interface.serial
        sent = bb.InterfaceMessage(
            interface.serial, source, message.type, message.id, message.hops, message.to_bytes()
        )
        self.session.send(sent.to_bytes())
        if not message.enqueued:
            message.mark_enqueued(self._now_us())  # in the queue at the client: it cannot be sent again
        return False

    def reader_added(self, interface: Interface, serial: UUID) -> None:
        self._send_event(bb.Kind.READER_ADDED, interface, serial)

    def reader_removed(self, interface: Interface, serial: UUID) -> None:
        self._send_event(bb.Kind.READER_REMOVED, interface, serial)

    def writer_added(self, interface: Interface, serial: UUID) -> None:
        self._send_event(bb.Kind.WRITER_ADDED, interface, serial)

    def writer_removed(self, interface: Interface, serial: UUID) -> None:
        self._send_event(bb.Kind.WRITER_REMOVED, interface, serial)

    def _send_event(self, kind: bb.Kind, interface: Interface, serial: UUID) -> None:
        with self._lock:
            if self._known:
                self.session.send(bb.InstanceEvent(kind, interface.serial, serial).to_bytes())


class _Births(Observer):
    """Tells all clients of interfaces that come into being and vanish."""

    def __init__(self, broadcast: Callable[[bytes], None]) -> None:
        self._broadcast: Final = broadcast

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        self._tell(bb.Kind.INTERFACE_CREATED, interface_type, interface_id)

    def interface_destroyed(self, interface_type: str, interface_id: str) -> None:
        self._tell(bb.Kind.INTERFACE_DESTROYED, interface_type, interface_id)

    def _tell(self, kind: bb.Kind, interface_type: str, interface_id: str) -> None:
        self._broadcast(bb.InterfaceEvent(kind, interface_type, interface_id).to_bytes())


class BlackBoardComponent(ServerComponent):
    """Serves a blackboard.

    :param board: the blackboard.
    :param logger: tells what clients do.
    :param complaints: about what they do wrong.
    :param echo: whether a writing client gets its own writes back, as from a Fawkes.
    """

    COMPONENT: ClassVar[Component] = Component.BLACKBOARD

    def __init__(self, board: BlackBoard, logger: Logger, complaints: Complaints, *, echo: bool) -> None:
        self._board: Final = board
        self._log: Final = logger
        self._complaints: Final = complaints
        self._echo: Final = echo
        self._opened: dict[Session, dict[UUID, _Opened]] = {}
        self._births: _Births | None = None

    def start(self, hub: Hub) -> None:
        """Begin to tell of interfaces that come and go."""
        self._births = _Births(hub.broadcast)
        self._board.register_observer(self._births)

    def stop(self) -> None:
        """Tell nothing any more."""
        if self._births is not None:
            self._board.unregister_observer(self._births)

    def handle(self, session: Session, frame: Frame) -> None:
        """Do what a client asks for; see the base class."""
        kind = frame.kind
        if kind in (bb.Kind.DATA_REFRESHED, bb.Kind.DATA_CHANGED):
            serial, block = bb.split_data(frame.payload)
            self._write(session, UUID(bytes=serial), block, changed=kind == bb.Kind.DATA_CHANGED)
        elif kind == bb.Kind.INTERFACE_MESSAGE:
            self._enqueue(session, bb.InterfaceMessage.unpack(frame.payload))
        elif kind in (bb.Kind.OPEN_FOR_READING, bb.Kind.OPEN_FOR_WRITING):
            self._open(session, frame)
        elif kind == bb.Kind.CLOSE:
            self._close(session, bb.Close.unpack(frame.payload).serial)
        elif kind == bb.Kind.LIST_ALL:
            self._list(session, "*", "*")
        elif kind == bb.Kind.LIST:
            asked = bb.ListMatching.unpack(frame.payload)
            self._list(session, asked.type_pattern, asked.id_pattern)
        else:
            raise MalformedMessageError(f"Unknown message of type {kind} received")

    def disconnected(self, session: Session) -> None:
        """Close all that a client had open."""
        for opened in self._opened.pop(session, {}).values():
            self._log.debug(
                f"Closing interface {opened.instance.uid} of remote {session.number} (client disconnected)"
            )
            self._release(opened)

    # -- opening and closing

    def _open(self, session: Session, frame: Frame) -> None:
        error: bb.OpenError | None = None
        try:
            asked = bb.Open.unpack(frame.payload, writing=frame.kind == bb.Kind.OPEN_FOR_WRITING)
            self._log.debug(f"Remote opens interface {asked.type}::{asked.id}")
            error = self._try_open(session, asked)
        except BlackBoardError:
            session.send(bb.OpenFailure(bb.OpenError.UNKNOWN).to_bytes())  # somebody waits for an answer
            raise
        if error is not None:
            session.send(bb.OpenFailure(error).to_bytes())
            self._complaints.add(
                f"open {error} {session.peer}",
                f"Opening interface {asked.type}::{asked.id} failed, {_FAILURES[error]}",
            )

    def _try_open(self, session: Session, asked: bb.Open) -> bb.OpenError | None:
        """Open an interface; return why not.

        :raises BlackBoardError: when there is no code for the reason.
        """
        of_client = self._opened.setdefault(session, {})
        if len(of_client) >= MOST_INSTANCES:
            raise BlackBoardError(f"{session!r} has {MOST_INSTANCES} interfaces open, more are refused")
        try:
            interface_class = self._board.registry.get(asked.type)
            if not accepts_hash(interface_class.SCHEMA, asked.hash):
                return bb.OpenError.HASH_MISMATCH  # before anything is opened, or it would stay open
            open_it = self._board.open_for_writing if asked.writing else self._board.open_for_reading
            instance = open_it(interface_class, asked.id, owner=OWNER)
        except (UnknownTypeError, InterfaceError):
            return bb.OpenError.UNKNOWN_TYPE
        except WriterActiveError:
            return bb.OpenError.WRITER_EXISTS
        except VersionMismatchError:
            return bb.OpenError.HASH_MISMATCH
        opened = of_client[instance.serial] = _Opened(instance, session, self._board.clock.now_us)
        self._listen(opened)
        session.largest_block = max(session.largest_block, _largest_block(interface_class))
        opened.introduce()
        return None

    def _listen(self, opened: _Opened) -> None:
        if opened.instance.is_writer and not self._echo:
            kinds = (*_INSTANCE_EVENTS, EventKind.MESSAGE_RECEIVED)
            self._board.register_listener(opened, opened.instance, *kinds)
        else:
            self._board.register_listener(opened, opened.instance)

    def _close(self, session: Session, serial: UUID) -> None:
        opened = self._opened.get(session, {}).pop(serial, None)
        if opened is None:
            raise BlackBoardError(
                f"Client {session.number} tried to close interface with serial {serial} "
                "which has not been opened"
            )
        self._log.debug(f"Remote {session.number} closing interface {opened.instance.uid}")
        self._release(opened)

    def _release(self, opened: _Opened) -> None:
        self._board.unregister_listener(opened, opened.instance)
        self._board.close(opened.instance)

    # -- looking around

    def _list(self, session: Session, type_glob: str, id_glob: str) -> None:
        registry = self._board.registry
        infos = (
            bb.Info(
                type=info.type,
                id=info.id,
                hash=hash_to_tell(registry, info.type, info.hash),
                number=info.serial,
                has_writer=info.has_writer,
                num_readers=info.num_readers,
                timestamp_us=info.timestamp_us,
            )
            for info in self._board.list(type_glob, id_glob)
        )
        session.send(bb.InterfaceList(tuple(infos)).to_bytes())

    # -- data and messages

    def _write(self, session: Session, serial: UUID, block: bytes, *, changed: bool) -> None:
        instance = self._instance(session, serial, "DATA")
        if not instance.is_writer:
            raise BlackBoardError(f"DATA: {session!r} writes to {instance.uid}, which it reads, ignoring.")
        if len(block) != instance.SCHEMA.datasize:
            raise BlackBoardError(
                f"DATA: Data size mismatch, expected {instance.SCHEMA.datasize}, "
                f"but got {len(block)}, ignoring."
            )
        instance.set_from_chunk(block)
        if changed:
            _mark_written(instance, block)
        instance.write()  # with the client's time stamp

    def _enqueue(self, session: Session, received: bb.InterfaceMessage) -> None:
        instance = self._instance(session, received.serial, "MESSAGE")
        if instance.is_writer:
            raise BlackBoardError(
                "MESSAGE: Received message notification, but for a writing instance, ignoring."
            )
        message = instance.create_message(received.type)
        if len(received.block) != message.SCHEMA.datasize:
            raise BlackBoardError(
                f"MESSAGE: Data size mismatch, expected {message.SCHEMA.datasize}, "
                f"but got {len(received.block)}, ignoring."
            )
        message.set_from_chunk(received.block)
        message.address(received.id, instance.mem_serial, instance.serial, received.source)
        message.mark_foreign(received.hops)
        self._log.debug(
            f"Processing message from sender {instance.serial}, source {received.source}, "
            f"mm source {received.source}"
        )
        instance.msgq_enqueue(message, proxy=True, message_id=received.id)

    def _instance(self, session: Session, serial: UUID, what: str) -> Interface:
        opened = self._opened.get(session, {}).get(serial)
        if opened is None:
            raise BlackBoardError(f"{what}: Interface with serial {serial} not found, ignoring.")
        return opened.instance


def _mark_written(instance: Interface, block: bytes) -> None:
    """Note that values and time stamp are new, even if the client's clock stands still."""
    instance.mark_data_changed()
    seconds, microseconds = STAMP.unpack_from(block)
    if 0 <= seconds <= _LAST_SECOND and 0 <= microseconds < MICROSECONDS:
        instance.auto_timestamping = False
        instance.set_timestamp(instance.timestamp_us)


def _largest_block(interface_class: type[Interface]) -> int:
    """Return the bytes of the largest block of an interface, its messages included."""
    schema = interface_class.SCHEMA
    return max(schema.datasize, *(message.datasize for message in schema.messages), 0)
