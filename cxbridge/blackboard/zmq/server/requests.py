"""The effect of clients' frames on the local blackboard; all code runs in the server's thread."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any, Final
from uuid import UUID

from cxbridge.blackboard.errors import UnknownTypeError, VersionMismatchError
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.kit.server import check_client_limits
from cxbridge.blackboard.listeners import EventKind, ListenerTable
from cxbridge.blackboard.local import LocalBlackBoard
from cxbridge.blackboard.names import check_names
from cxbridge.blackboard.port import make_received_message
from cxbridge.blackboard.publications import HANDLED, QUEUED, REFUSED, emit_message
from cxbridge.blackboard.zmq.server.channels import Channel, RemoteWriter, ServerLoop
from cxbridge.blackboard.zmq.server.deliveries import Deliveries, ForwardedQueue, Forwarder, OutcomeCallback
from cxbridge.blackboard.zmq.server.sessions import ZmqSession
from cxbridge.blackboard.zmq.wire.frames import (
    MAX_TEXT_LENGTH,
    Beat,
    ClientFrame,
    Close,
    Credit,
    Deliver,
    Delivered,
    List,
    Listed,
    Member,
    Open,
    Opened,
    Request,
    ResultCode,
    Send,
    Sync,
    Watch,
    Write,
)
from cxbridge.blackboard.zmq.wire.refusals import make_refusal
from cxbridge.errors import CxbridgeError, InterfaceError
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.known_hashes import accepts_hash
from cxbridge.rights import ALL_RIGHTS, Rights

_OUTCOME_BY_CODE: Final = {ResultCode.OK: QUEUED, ResultCode.DECLINED: HANDLED}


class RequestHandler:
    """Carries out the frames of clients on a local blackboard.

    :param loop: the server's thread.
    :param delivery_timeout_s: the seconds in which a client must report the outcome of a message to its
        writer.
    :param log: logs a line.
    :param rights: the rights of clients, for opened writers and sent messages.
    """

    def __init__(
        self,
        board: LocalBlackBoard,
        loop: ServerLoop,
        delivery_timeout_s: float,
        log: Callable[[str], None],
        rights: Rights = ALL_RIGHTS,
    ) -> None:
        self._rights = rights
        self._board = board
        self._loop = loop
        self._delivery_timeout_s = delivery_timeout_s
        self._log = log
        self._channels: dict[str, Channel] = {}  # by uid
        self.deliveries: Final = Deliveries()
        self._handlers: Final[dict[type[Any], Callable[[ZmqSession, Any], None]]] = {
            Open: self._handle_open,
            Close: self._handle_close,
            List: self._handle_list,
            Watch: self._handle_watch,
            Sync: self._handle_sync,
            Send: self._handle_send,
        }

    def handle(self, session: ZmqSession, frame: ClientFrame) -> None:
        """Carry out a frame of a client; an error of a request becomes its reply.

        :raises ProtocolError: if the frame is invalid within a session.
        """
        match frame:
            case Write():  # first, because nearly all frames are writes
                self._handle_write(session, frame)
            case Credit():
                session.give_credit(frame.updates)
            case Delivered():
                self.deliveries.finish(session, frame)
            case Request():
                try:
                    self._handlers[type(frame)](session, frame)
                except CxbridgeError as error:
                    session.send(make_refusal(error, frame.request))
            case Beat():
                pass  # the server has recorded the time of this sign of life, as for each frame
            case _:
                raise ProtocolError(f"{type(frame).__name__} is not allowed within a session")

    def _handle_open(self, session: ZmqSession, frame: Open) -> None:
        interface_class = self._find_class(frame.type, frame.id)
        schema = interface_class.SCHEMA
        check_client_limits(session.instances.values(), schema)
        if frame.writer:
            self._rights.check_writer(f"{frame.type}::{frame.id}")
        # before the opening, so that a refused client leaves no open instance
        if not accepts_hash(schema, frame.hash) or schema.datasize != frame.size:
            raise VersionMismatchError(f"{frame.type}::{frame.id}", schema.hash, frame.hash)
        if frame.writer:
            instance = self._board.open_for_writing(
                interface_class, frame.id, owner=frame.owner, listen=self._forward_messages
            )
        else:
            instance = self._board.open_for_reading(interface_class, frame.id, owner=frame.owner)
        # sends the updates of earlier writes before the reply, whose data are newer
        self._loop.run_posted_calls()
        serial = instance.serial.bytes
        session.instances[serial] = instance
        channel = self._ensure_channel(instance)
        snapshot = channel.join(session, instance)
        session.send(
            Opened(
                serial,
                channel.memory.mem_serial,
                session.memberships[channel].sent_seq,
                snapshot is not None and snapshot.last_stamped > 0,
                snapshot is not None and snapshot.last_changed > 0,
                [
                    Member(member.serial.bytes, member.owner, member.is_writer)
                    for member in channel.memory.instances()
                ],
                None if snapshot is None else snapshot.block,
                request=frame.request,
            )
        )

    def _find_class(self, interface_type: str, interface_id: str) -> type[Interface]:
        check_names(interface_type, interface_id)
        try:
            return self._board.registry.get(interface_type)
        except InterfaceError as error:
            raise UnknownTypeError(interface_type, hint=error.hint) from error

    def _ensure_channel(self, instance: Interface) -> Channel:
        channel = self._channels.get(instance.uid)
        if channel is None:
            channel = self._channels[instance.uid] = Channel(self._loop, self._board.find_memory(instance))
        return channel

    def _forward_messages(self, instance: Interface, listeners: ListenerTable) -> None:
        """Forward messages of this process to a client's writer."""
        forwarder = Forwarder(self._loop, self._deliver_message, self._delivery_timeout_s, self._log)
        instance.divert_queue(ForwardedQueue(instance.uid, forwarder))
        listeners.register(forwarder, instance, (EventKind.MESSAGE_RECEIVED,))

    def _handle_close(self, session: ZmqSession, frame: Close) -> None:
        instance = session.instances.get(frame.instance)
        if instance is None:
            session.reply(frame.request, ResultCode.INVALID_INSTANCE)
        else:
            session.reply(frame.request, detail=self.close(session, instance))

    def close(self, session: ZmqSession, instance: Interface) -> int:
        """Close an instance of a session; return the sequence number of the client's copy."""
        serial = instance.serial.bytes
        channel = self._channels[instance.uid]
        if instance.valid:
            self._board.close(instance)
        sent_seq = channel.leave(session, instance)
        del session.instances[serial]
        self.deliveries.fail_deliveries(session, serial)
        if not channel.memberships:
            channel.end()
            del self._channels[instance.uid]
        return sent_seq

    def end_session(self, session: ZmqSession) -> None:
        """Close the instances of a session and fail its deliveries."""
        self.deliveries.fail_deliveries(session)
        for instance in list(session.instances.values()):
            self.close(session, instance)

    def _handle_write(self, session: ZmqSession, frame: Write) -> None:
        """Publish the block of a session's writer."""
        instance = session.instances.get(frame.instance)
        if instance is None or not instance.is_writer:
            self._log(f"{session} writes an interface that it has not opened for writing")
        elif len(frame.block) != instance.SCHEMA.datasize:
            raise ProtocolError(f"a block of {instance.type} cannot have {len(frame.block)} bytes")
        elif instance.valid:
            instance.publish_block(frame.block, frame.stamped, frame.changed)

    def _handle_send(self, session: ZmqSession, frame: Send) -> None:
        sender = session.instances.get(frame.instance)
        if sender is None or sender.is_writer:
            session.reply(frame.request, ResultCode.INVALID_INSTANCE)
            return
        message_class = sender.MESSAGES.get(frame.type)
        if message_class is None or len(frame.block) != message_class.SCHEMA.datasize:
            session.reply(frame.request, ResultCode.UNKNOWN_MESSAGE)
            return
        self._rights.check_message(sender.type, frame.type)
        message = make_received_message(
            sender,
            frame.type,
            frame.block,
            message_id=frame.id,
            sender=sender.serial,
            source=UUID(bytes=frame.source),
            hops=frame.hops + 1,
            thread=frame.thread,
        )
        writer = self._channels[sender.uid].writer
        if writer is not None:

            def on_outcome(code: ResultCode, detail: int) -> None:
                self._emit_message(sender, message, _OUTCOME_BY_CODE.get(code, REFUSED))
                session.reply(frame.request, code, detail)

            self._start_delivery(writer, message, frame.hops, on_outcome)
        elif sender.has_writer:
            self._board.find_memory(sender).transmit(sender, message)
            session.reply(frame.request, ResultCode.OK if message.enqueued else ResultCode.DECLINED)
        else:
            self._emit_message(sender, message, REFUSED)
            session.reply(frame.request, ResultCode.NO_WRITER)

    def _start_delivery(
        self, writer: RemoteWriter, message: Message, hops: int, on_outcome: OutcomeCallback
    ) -> None:
        """Send a message to a writer in a client.

        :param hops: the number of networks before this server.
        """
        session, instance = writer
        assert message.sender_id is not None
        assert message.source_id is not None
        frame = Deliver(
            instance.serial.bytes,
            message.source_id.bytes,
            message.sender_id.bytes,
            message.type,
            message.id,
            message.sender_thread_name[:MAX_TEXT_LENGTH],
            hops,
            message.to_bytes(),
        )
        self.deliveries.start(session, frame, on_outcome, time.monotonic() + self._delivery_timeout_s)

    def _emit_message(self, sender: Interface, message: Message, outcome: str) -> None:
        """Emit the event of a client's message that no writer of this process receives."""
        emit_message(self._board.bus, self._board.clock.now_us(), sender.uid, sender.owner, message, outcome)

    def _deliver_message(self, writer: Interface, message: Message, on_outcome: OutcomeCallback) -> None:
        """Send a message of this process to a writer in a client."""
        channel = self._channels.get(writer.uid)
        # the writer may have been closed after the call of the listener
        if channel is None or channel.writer is None or channel.writer.instance is not writer:
            on_outcome(ResultCode.NO_WRITER, 0)
        else:
            self._start_delivery(channel.writer, message, message.hops, on_outcome)

    def _handle_list(self, session: ZmqSession, frame: List) -> None:
        infos = self._board.list(frame.type_glob, frame.id_glob)
        session.send(Listed(list(infos), request=frame.request))

    def _handle_watch(self, session: ZmqSession, frame: Watch) -> None:
        session.is_watching = True  # before the list, so that the client misses no interface in between
        session.send(Listed(list(self._board.list_all()), request=frame.request))

    def _handle_sync(self, session: ZmqSession, frame: Sync) -> None:
        self._loop.run_posted_calls()  # sends the updates of this process' earlier writes before the reply
        session.reply(frame.request)
