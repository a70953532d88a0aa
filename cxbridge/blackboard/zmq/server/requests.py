"""Requests of clients on the local blackboard; all code runs in the server's thread."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any, Final

from cxbridge.blackboard.errors import UnknownTypeError, VersionMismatchError
from cxbridge.blackboard.info import InterfaceInfo
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.kit.room import check_room
from cxbridge.blackboard.listeners import EventKind, ListenerTable
from cxbridge.blackboard.local import LocalBlackBoard
from cxbridge.blackboard.names import check_names
from cxbridge.blackboard.publications import HANDLED, QUEUED, REFUSED, emit_message
from cxbridge.blackboard.zmq.server.channels import Channel, InterfaceValue, ServerLoop
from cxbridge.blackboard.zmq.server.deliveries import Deliveries, ForwardedQueue, Forwarder, Outcome
from cxbridge.blackboard.zmq.server.sessions import ZmqSession
from cxbridge.blackboard.zmq.wire.codec import ResultCode, Stamp
from cxbridge.blackboard.zmq.wire.dataframes import DeliverBody, ZmqFrame
from cxbridge.blackboard.zmq.wire.messages import deliver_body, receive_message
from cxbridge.blackboard.zmq.wire.refusals import refusal_of
from cxbridge.errors import CxbridgeError, InterfaceError
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.known_hashes import accepts_hash
from cxbridge.rights import EVERYTHING, Rights

_CODES: Final = {int(code): code for code in ResultCode}
_OUTCOMES: Final = {ResultCode.OK: QUEUED, ResultCode.DECLINED: HANDLED}
_STAMPED: Final = {int(Stamp.COMPARE): None, int(Stamp.OLD): False, int(Stamp.NEW): True}


class RequestHandler:
    """Carries out requests of clients on a local blackboard.

    :param loop: the server's thread.
    :param delivery_timeout: seconds in which a client must take a message for its writer.
    :param log: called with a text for the log.
    """

    def __init__(
        self,
        board: LocalBlackBoard,
        loop: ServerLoop,
        delivery_timeout: float,
        log: Callable[[str], None],
        rights: Rights = EVERYTHING,
    ) -> None:
        self._rights = rights
        self._board = board
        self._loop = loop
        self._delivery_timeout = delivery_timeout
        self._log = log
        self._channels: dict[int, Channel] = {}
        self.deliveries: Final = Deliveries()

    def handle(self, session: ZmqSession, frame: ZmqFrame) -> None:
        """Carry out the request of a frame.

        :raises ProtocolError: if the kind of frame is invalid for clients.
        """
        handler = getattr(self, f"_on_{frame.kind}", None)
        if handler is None:
            raise ProtocolError(f"{frame.kind} is nothing that a client sends")
        try:
            handler(session, frame)
        except CxbridgeError as error:
            if isinstance(error, ProtocolError) or not hasattr(frame.body, "request"):
                raise
            code, fields = refusal_of(error)
            answer = session.answer if frame.kind == "send" else session.reply
            answer(frame.body.request, code, **fields)

    def _on_open(self, session: ZmqSession, frame: ZmqFrame) -> None:
        body = frame.body
        interface_class = self._class_of(body.type, body.id)
        check_room(session.instances.values(), interface_class.SCHEMA)
        if body.writer:
            self._rights.check_writer(f"{body.type}::{body.id}")
        schema = interface_class.SCHEMA
        if not accepts_hash(schema, body.hash) or schema.datasize != body.size:
            raise VersionMismatchError(f"{body.type}::{body.id}", schema.hash, body.hash)
        if body.writer:
            instance = self._board.open_for_writing(
                interface_class, body.id, owner=body.owner, listen=self._forward_messages
            )
        else:
            instance = self._board.open_for_reading(interface_class, body.id, owner=body.owner)
        self._loop.drain()  # earlier writes of other clients must be sent before the reply
        serial = instance.serial.bytes
        session.instances[serial] = instance
        channel = self._channel_of(instance)
        value = channel.join(session, instance)
        session.reply(
            body.request,
            opened=_opened(channel, serial, value, session.memberships[channel].sent),
            block=None if value is None else value.block,
        )

    def _class_of(self, interface_type: str, interface_id: str) -> type[Interface]:
        check_names(interface_type, interface_id)
        try:
            return self._board.registry.get(interface_type)
        except InterfaceError as error:
            raise UnknownTypeError(interface_type, hint=error.hint) from error

    def _channel_of(self, instance: Interface) -> Channel:
        memory = self._board.memory_of(instance)
        channel = self._channels.get(memory.mem_serial)
        if channel is None:
            channel = self._channels[memory.mem_serial] = Channel(self._board, self._loop, memory)
        return channel

    def _forward_messages(self, instance: Interface, listeners: ListenerTable) -> None:
        """Forward messages of this process to a client's writer."""
        forwarder = Forwarder(self._loop, self._deliver, self._delivery_timeout, self._log)
        instance.divert_queue(ForwardedQueue(instance.uid, forwarder))
        listeners.register(forwarder, instance, (EventKind.MESSAGE_RECEIVED,))

    def _on_close(self, session: ZmqSession, frame: ZmqFrame) -> None:
        instance = session.instances.get(frame.body.instance)
        if instance is None:
            session.reply(frame.body.request, ResultCode.INVALID_INSTANCE)
        else:
            session.reply(frame.body.request, detail=self.close(session, instance))

    def close(self, session: ZmqSession, instance: Interface) -> int:
        """Close an instance of a session; return the client's sequence number."""
        channel = self._channel_by_instance(instance)
        if instance.valid:
            channel.hand_over(instance)
            self._board.close(instance)
        sent = channel.leave(session, instance)
        del session.instances[instance.serial.bytes]
        self.deliveries.drop(session, instance.serial.bytes)
        if not channel.members:
            self._channels.pop(channel.memory.mem_serial, None)
        return sent

    def _channel_by_instance(self, instance: Interface) -> Channel:
        """Return the channel of an instance, which may be invalid after a shutdown of the blackboard."""
        if instance.valid:
            return self._channels[instance.mem_serial]
        serial = instance.serial.bytes
        return next(
            channel
            for channel in self._channels.values()
            if any(serial in membership.instances for membership in channel.members.values())
        )

    def end(self, session: ZmqSession) -> None:
        """Close the instances of a session and fail its deliveries."""
        self.deliveries.drop(session)
        for instance in list(session.instances.values()):
            self.close(session, instance)

    def write(self, session: ZmqSession, serial: bytes, stamp: int, changed: bool, block: bytes) -> None:
        """Publish the block of a session's writer.

        :raises ProtocolError: if its size is wrong.
        """
        instance = session.instances.get(serial)
        if instance is None or not instance.is_writer:
            self._log(f"{session} writes what it has not open for writing")
        elif len(block) != instance.SCHEMA.datasize:
            raise ProtocolError(f"a block of {instance.type} has not {len(block)} bytes")
        elif instance.valid:
            self._channels[instance.mem_serial].write(instance, block, _STAMPED.get(stamp), changed)

    def _on_credit(self, session: ZmqSession, frame: ZmqFrame) -> None:
        session.give_credit(frame.body.updates)

    def _on_beat(self, session: ZmqSession, frame: ZmqFrame) -> None:
        pass

    def _on_send(self, session: ZmqSession, frame: ZmqFrame) -> None:
        body = frame.body
        sender = session.instances.get(body.instance)
        if sender is None or sender.is_writer:
            session.answer(body.request, ResultCode.INVALID_INSTANCE)
            return
        message_class = sender.MESSAGES.get(body.type)
        if message_class is None or len(frame.block or b"") != message_class.SCHEMA.datasize:
            session.answer(body.request, ResultCode.UNKNOWN_MESSAGE)
            return
        assert frame.block is not None
        self._rights.check_message(sender.type, body.type)
        received = receive_message(message_class, body, frame.block, body.instance, sender.mem_serial)
        writer = self._channels[sender.mem_serial].writer
        if writer is not None:
            message = DeliverBody(
                0, b"", body.source, body.instance, body.type, body.id, body.thread, body.hops
            )

            def done(code: ResultCode, detail: int) -> None:
                self._emit(sender, received, _OUTCOMES.get(code, REFUSED))
                session.answer(body.request, code, detail)

            self.deliveries.start(
                *writer, message, frame.block, done, time.monotonic() + self._delivery_timeout
            )
        elif sender.has_writer:
            self._board.memory_of(sender).transmit(sender, received)
            session.answer(body.request, ResultCode.OK if received.enqueued else ResultCode.DECLINED)
        else:
            self._emit(sender, received, REFUSED)
            session.answer(body.request, ResultCode.NO_WRITER)

    def _emit(self, sender: Interface, message: Message, outcome: str) -> None:
        """Emit the event of a message between clients."""
        emit_message(self._board.bus, self._board.clock.now_us(), sender.uid, sender.owner, message, outcome)

    def _on_delivered(self, session: ZmqSession, frame: ZmqFrame) -> None:
        body = frame.body
        code = _CODES.get(body.code, ResultCode.REFUSED)
        self.deliveries.finish(session, body.delivery, code, body.detail)

    def _deliver(self, writer: Interface, message: Message, done: Outcome) -> None:
        """Send a message of this process to a writer in a client."""
        channel = self._channels.get(writer.mem_serial)
        if channel is None or channel.writer is None or channel.writer[1] is not writer:
            done(ResultCode.NO_WRITER, 0)
            return
        deadline = time.monotonic() + self._delivery_timeout
        self.deliveries.start(*channel.writer, deliver_body(message), message.to_bytes(), done, deadline)

    def _on_list(self, session: ZmqSession, frame: ZmqFrame) -> None:
        found = self._board.list(frame.body.type_glob, frame.body.id_glob)
        _reply_list(session, frame.body.request, found)

    def _on_watch(self, session: ZmqSession, frame: ZmqFrame) -> None:
        session.watching = True
        _reply_list(session, frame.body.request, self._board.list_all())

    def _on_sync(self, session: ZmqSession, frame: ZmqFrame) -> None:
        self._loop.drain()  # the reply must follow the earlier writes of this process
        session.reply(frame.body.request)


def _reply_list(session: ZmqSession, request: int, found: Sequence[InterfaceInfo]) -> None:
    infos = [
        {
            "type": info.type,
            "id": info.id,
            "hash": info.hash,
            "serial": info.serial,
            "has_writer": info.has_writer,
            "writer": info.writer,
            "readers": info.readers,
            "timestamp_us": info.timestamp_us,
        }
        for info in found
    ]
    session.reply(request, interfaces=infos)


def _opened(channel: Channel, serial: bytes, value: InterfaceValue | None, seq: int) -> dict[str, Any]:
    members = [
        {"instance": member.serial.bytes, "owner": member.owner, "writer": member.is_writer}
        for member in channel.memory.instances()
    ]
    return {
        "instance": serial,
        "channel": channel.memory.mem_serial,
        "seq": seq,
        "stamped": value is not None and value.stamped > 0,
        "changed": value is not None and value.changed > 0,
        "members": members,
    }
