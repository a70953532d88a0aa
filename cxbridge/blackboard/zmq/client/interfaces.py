"""The open interfaces of a client, and the effect of the server's frames on them.

The receiving thread handles frames; any thread may write and send requests. The lock guards the tables,
except in single look-ups. Under the sender's lock, a write is either sent or kept in ``_unsent_copies``, so
that a new session misses no write.
"""

from __future__ import annotations

import threading
from collections.abc import Callable
from functools import partial
from typing import Final
from uuid import UUID

from cxbridge.blackboard.base import OpenRequest
from cxbridge.blackboard.kit.board import RemoteBlackBoard
from cxbridge.blackboard.kit.errors import ProtocolError
from cxbridge.blackboard.listeners import ObserverTable
from cxbridge.blackboard.zmq.client.port import InterfaceCopy
from cxbridge.blackboard.zmq.client.receiving import EventReceiver
from cxbridge.blackboard.zmq.client.sending import CommandSender, PendingRequest
from cxbridge.blackboard.zmq.wire.frames import (
    MAX_TEXT_LENGTH,
    Change,
    Close,
    Deliver,
    Delivered,
    Existence,
    Listed,
    Open,
    Opened,
    Reply,
    Request,
    Response,
    ResultCode,
    Send,
    ServerFrame,
    Update,
    Watch,
    Write,
)
from cxbridge.blackboard.zmq.wire.refusals import raise_refusal
from cxbridge.interfaces.instance import Interface, Message
from cxbridge.interfaces.schema import InterfaceSchema


class OpenInterfaces:
    """Instances and copies of a client, and their state in the session.

    :param board: the blackboard of the client.
    :param url: the server's endpoint, for log lines.
    :param timeout_s: the limit of a request, in seconds.
    """

    def __init__(
        self,
        board: RemoteBlackBoard,
        url: str,
        timeout_s: float,
        sender: CommandSender,
        receiver: EventReceiver,
        observers: ObserverTable,
    ) -> None:
        self._board: Final = board
        self._url: Final = url
        self._timeout_s: Final = timeout_s
        self._sender: Final = sender
        self._receiver: Final = receiver
        self._lock: Final = threading.RLock()
        self._copies: dict[tuple[str, str], InterfaceCopy] = {}  # by type and id
        self._copies_by_channel: dict[int, InterfaceCopy] = {}  # by the server's number, in this session
        self._instances: dict[bytes, Interface] = {}  # by serial
        self._unsent_copies: set[InterfaceCopy] = set()  # copies with a write that waits for a session
        self._epoch = b""  # the id of the running server
        self._is_same_epoch = False  # whether the last two sessions were with the same run of the server
        self._missing_reply_count = 0  # the number of replies that must come before other threads may send
        self._is_loss_announced = False
        self._observers: Final = observers
        self._known_keys: set[tuple[str, str]] = set()  # interfaces that the observers know
        self.is_watching = False
        """Whether the server reports created and destroyed interfaces."""
        self.end_reason = ""
        """The reason for the end of the last session; empty before."""
        self.skipped = 0
        """The number of conflated updates."""

    def open(self, request: OpenRequest) -> Interface:
        """Open an interface at the server.

        :raises BlackBoardError: if the server refuses, or does not reply in time.
        """
        opened: list[Interface] = []  # filled by the receiving thread before the request returns

        def on_reply(reply: Response) -> None:
            if isinstance(reply, Opened):
                opened.append(self._make_instance(request, reply))

        schema = request.interface_class.SCHEMA
        frame = _make_open_frame(schema, request.id, request.owner, request.is_writer)
        reply = self._sender.request(frame, timeout_s=self._timeout_s, on_reply=on_reply)
        if isinstance(reply, Reply):
            raise_refusal(reply, uid=request.uid, hash_=schema.hash)
        return opened[0]

    def _make_instance(self, request: OpenRequest, opened: Opened) -> Interface:
        """Make the instance that the server has opened."""
        with self._lock:
            copy = self._copies.get(request.key)
            if copy is None:
                copy = self._copies[request.key] = InterfaceCopy(
                    self._board, request.interface_class, request.id, self, self._receiver
                )
                copy.set_members(opened.members, quietly=True)
            self._assign_channel(copy, opened.channel)
            if opened.block is not None and opened.seq > copy.seq:
                if copy.instances:  # otherwise no instance has missed an update
                    self.skipped += opened.seq - copy.seq - 1
                copy.update(opened.seq, opened.block, opened.stamped, opened.changed)
            copy.seq = opened.seq
            instance = request.make_instance(copy, UUID(bytes=opened.instance))
            copy.instances.append(instance)
            self._instances[opened.instance] = instance
            return instance

    def _assign_channel(self, copy: InterfaceCopy, channel_number: int) -> None:
        copy.mem_serial = channel_number
        self._copies_by_channel[channel_number] = copy

    def has_instance(self, instance: Interface) -> bool:
        """Return whether an instance is open at this client."""
        return self._instances.get(instance.serial.bytes) is instance

    def find_copy(self, instance: Interface) -> InterfaceCopy | None:
        """Return the copy of an instance; None if the instance is not open at this client."""
        with self._lock:
            return self._copies.get((instance.type, instance.id)) if self.has_instance(instance) else None

    def start_closing(self, instance: Interface) -> InterfaceCopy:
        """Invalidate an instance and return its copy; its listeners get events until `finish_closing`."""
        with self._lock:
            copy = self._copies[instance.type, instance.id]
            del self._instances[instance.serial.bytes]
            instance.invalidate()
            return copy

    def finish_closing(self, copy: InterfaceCopy, instance: Interface, seq: int) -> None:
        """Remove an instance that the server has closed.

        :param seq: the sequence number of the copy after the closing.
        """
        with self._lock:
            if instance in copy.instances:
                copy.instances.remove(instance)
            copy.seq = seq
            if instance.is_writer:
                self._unsent_copies.discard(copy)
                copy.has_own_data = False
            self._drop_if_unused(copy)
        copy.end_listening(instance)

    def _drop_if_unused(self, copy: InterfaceCopy) -> None:
        if not copy.instances:
            if self._copies.get(copy.key) is copy:
                del self._copies[copy.key]
            if self._copies_by_channel.get(copy.mem_serial) is copy:
                del self._copies_by_channel[copy.mem_serial]

    def invalidate_all(self) -> None:
        """Invalidate all instances without notifying listeners."""
        with self._lock:
            for instance in self._instances.values():
                instance.invalidate()
            self._instances.clear()
            self._copies.clear()
            self._copies_by_channel.clear()

    def write(
        self, copy: InterfaceCopy, serial: UUID, stamped: bool | None, changed: bool, block: bytes
    ) -> None:
        """Send a write; without a session, the next session begins with the last write."""
        with self._sender.lock:
            if self._sender.is_ready and self._sender.send(Write(serial.bytes, stamped, changed, block)):
                copy.seq += 1
                self._unsent_copies.discard(copy)
            else:
                self._unsent_copies.add(copy)

    def count_skipped(self) -> None:
        """Count an update that a later update replaced because listeners are slow."""
        self.skipped += 1

    def send_message(self, sender: Interface, message: Message) -> None:
        """Send a message and wait until the writer's queue or a listener of the writer has it.

        :raises NoWriterError: if the interface has no writer.
        :raises QueueFullError: if the queue is full.
        :raises RequestTimeoutError: if the writer or the server does not reply in time.
        :raises DisconnectedError: if the session is missing or lost; the message may have been delivered.
        :raises BlackBoardError: if the server refuses the message for another reason.
        """
        frame = Send(
            sender.serial.bytes,
            (message.source_id or sender.serial).bytes,
            message.type,
            message.id,
            message.sender_thread_name[:MAX_TEXT_LENGTH],
            message.hops,
            message.to_bytes(),
        )
        reply = self._sender.request(frame, timeout_s=self._timeout_s, repeat=False)
        assert isinstance(reply, Reply)
        match reply.code:
            case ResultCode.OK:
                message.mark_enqueued(self._board.clock.now_us())
            case ResultCode.DECLINED:
                pass  # a listener of the writer has handled the message
            case ResultCode.NO_WRITER:
                self._board.refuse_message(sender, message)
            case _:
                raise_refusal(reply, uid=sender.uid, message_type=message.type, serial=sender.serial)

    def handle_welcome(self, epoch: bytes) -> None:
        """Reopen all instances in a new session."""
        self._is_same_epoch, self._epoch = epoch == self._epoch, epoch
        with self._lock:
            instances = [instance for copy in self._copies.values() for instance in copy.instances]
            self._copies_by_channel.clear()
            for copy in self._copies.values():
                copy.expected_seq = copy.seq
        # writers first, because a reader's reply is compared with the sequence number of this client's writer
        instances.sort(key=lambda instance: not instance.is_writer)
        # under one lock, so that no request of another thread comes in between
        with self._sender.lock:
            self._missing_reply_count = 1  # for this method, so that no early reply counts as the last reply
            for instance in instances:
                self._reopen(instance)
            if self.is_watching:
                self._request_counted(Watch(), self.handle_existing)
        self._count_reply()

    def _request_counted(self, frame: Request, on_reply: Callable[[Response], None]) -> None:
        """Send a request whose reply :meth:`_count_reply` counts."""

        def handle_and_count(reply: Response) -> None:
            on_reply(reply)
            self._count_reply()

        self._missing_reply_count += 1
        self._sender.start(frame, PendingRequest(handle_and_count))

    def _reopen(self, instance: Interface) -> None:
        frame = _make_open_frame(instance.SCHEMA, instance.id, instance.owner, instance.is_writer)
        self._request_counted(frame, lambda reply: self._handle_reopened(instance, reply))

    def _handle_reopened(self, instance: Interface, reply: Response) -> None:
        with self._lock:
            copy = self._copies.get((instance.type, instance.id))
            is_open = self._instances.pop(instance.serial.bytes, None) is instance
            if isinstance(reply, Reply):
                self._invalidate_refused(copy, instance, reply.code)
                return
            assert isinstance(reply, Opened)
            if copy is None or not is_open:
                self._close_unwanted(reply)  # another thread has closed the instance during the request
                return
            instance.adopt_serial(UUID(bytes=reply.instance))
            self._instances[reply.instance] = instance
            self._assign_channel(copy, reply.channel)
            if reply.block is not None:
                self._update_reopened(copy, reply, reply.block)
            if instance.is_writer and copy.has_own_data and self._is_write_lost(copy, reply.seq):
                self._unsent_copies.add(copy)
            copy.seq = reply.seq
            copy.set_members(reply.members, quietly=False)

    def _update_reopened(self, copy: InterfaceCopy, opened: Opened, block: bytes) -> None:
        """Update a copy with the data of a new session, unless the copy is newer."""
        # a restarted server counts from 0, and has no data before the first write
        is_outdated = opened.seq <= copy.expected_seq if self._is_same_epoch else opened.seq == 0
        if not is_outdated and copy not in self._unsent_copies:
            copy.update(opened.seq, block, opened.stamped, opened.changed)

    def _is_write_lost(self, copy: InterfaceCopy, seq: int) -> bool:
        """Return whether the last write of this client was lost with the previous session."""
        return seq < copy.expected_seq if self._is_same_epoch else seq == 0

    def _invalidate_refused(self, copy: InterfaceCopy | None, instance: Interface, code: ResultCode) -> None:
        """Invalidate an instance that the server refuses to reopen."""
        self._board.warn(
            f"{instance.uid} of {instance.owner or 'an unnamed owner'} could not be opened again: {code.name}"
        )
        instance.invalidate()
        if copy is not None:
            if instance in copy.instances:
                copy.instances.remove(instance)
            copy.has_own_data = False
            self._unsent_copies.discard(copy)
            copy.listeners.unregister(None, instance)
            self._drop_if_unused(copy)

    def _close_unwanted(self, opened: Opened) -> None:
        """Close an instance that the server has opened too late."""
        with self._sender.lock:
            self._sender.start(Close(opened.instance), PendingRequest())

    def _count_reply(self) -> None:
        """Count a reply to a reopening; after the last reply, let all threads send."""
        self._missing_reply_count -= 1
        if self._missing_reply_count:
            return
        with self._sender.lock:
            self._sender.set_ready()
            unsent_copies, self._unsent_copies = self._unsent_copies, set()
            for copy in unsent_copies:
                for instance in copy.instances:
                    if instance.is_writer and instance.valid:
                        # the block of the last unsent write; an earlier one may have changed the values
                        self.write(
                            copy, instance.serial, stamped=True, changed=True, block=copy.snapshot.block
                        )
        if self._is_loss_announced:
            self._is_loss_announced = False
            self._board.report_connection(True, f"connected to {self._url} again")

    def handle_loss(self, end_reason: str) -> None:
        """Report the loss of the session, and remove the instances of other clients."""
        if self._epoch and not self._is_loss_announced:
            self._is_loss_announced = True
            text = f"lost the blackboard at {self._url}: {end_reason}; reconnecting"
            self._board.report_connection(False, text)
        self.end_reason = end_reason
        with self._lock:
            for copy in self._copies.values():
                copy.remove_remote_members()

    def handle_update(self, update: Update) -> None:
        """Handle an Update.

        :raises ProtocolError: if an earlier update is missing, or the size of the block is wrong.
        """
        with self._lock:
            copy = self._copies_by_channel.get(update.channel)
            if copy is None or update.seq <= copy.seq:
                return
            if update.seq != copy.seq + 1 + update.skipped:
                raise ProtocolError(f"updates of {copy.uid} were lost")
            self.skipped += update.skipped
            copy.update(update.seq, update.block, update.stamped, update.changed)

    def handle_frame(self, frame: ServerFrame) -> None:
        """Handle a frame other than an Update."""
        match frame:
            case Response():
                if not self._sender.finish(frame) and isinstance(frame, Opened):
                    self._close_unwanted(frame)  # the caller has given up after the timeout
            case Change():
                copy = self._copies_by_channel.get(frame.channel)
                if copy is not None:
                    copy.change_member(frame.kind, UUID(bytes=frame.serial), frame.owner)
            case Deliver():
                self._receiver.put(self._deliver, frame, is_urgent=True)
            case Existence():
                if self.is_watching:
                    self._handle_existence((frame.type, frame.id), frame.created)
            case _:
                pass  # a Beat; the receiver has recorded the time of this sign of life

    def handle_existing(self, reply: Response) -> None:
        """Compare the interfaces in the reply to Watch with the known ones, and notify the observers."""
        assert isinstance(reply, Listed)
        keys = [(info.type, info.id) for info in reply.interfaces]
        if not self.is_watching:  # observers get no events for interfaces that exist at their registration
            self._known_keys.update(keys)
            self.is_watching = True
        for key in self._known_keys.difference(keys):
            self._handle_existence(key, created=False)
        for key in keys:
            self._handle_existence(key, created=True)

    def _handle_existence(self, key: tuple[str, str], created: bool) -> None:
        if created is not (key in self._known_keys):
            self._known_keys ^= {key}  # adds a created interface, removes a destroyed interface
            self._receiver.put(partial(self._observers.notify, *key, created=created))

    def _deliver(self, frame: Deliver) -> None:
        """Queue a message for a writer and report the outcome; in the dispatcher's thread."""
        instance = self._instances.get(frame.instance)
        copy = None if instance is None else self.find_copy(instance)
        code, detail = ResultCode.NO_WRITER, 0
        if instance is not None and copy is not None and instance.is_writer:
            code, detail = copy.queue_message(instance, frame)
        self._sender.send(Delivered(frame.delivery, code, detail))


def _make_open_frame(schema: InterfaceSchema, interface_id: str, owner: str, writer: bool) -> Open:
    return Open(schema.name, interface_id, schema.hash, schema.datasize, owner[:MAX_TEXT_LENGTH], writer)
