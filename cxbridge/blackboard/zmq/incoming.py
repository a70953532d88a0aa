"""What a client knows: its instances and mirrors, kept up to date by what comes from the server."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final
from uuid import UUID

from cxbridge.blackboard.errors import InvalidInstanceError, QueueFullError
from cxbridge.blackboard.listeners import Listen
from cxbridge.blackboard.observers import ObserverTable
from cxbridge.blackboard.zmq.access import receive
from cxbridge.blackboard.zmq.codec import Code, Kind, Stamp
from cxbridge.blackboard.zmq.dataframes import (
    UPDATE_HEADER,
    VERSION,
    Deliver,
    Delivered,
    Frame,
    other_version,
)
from cxbridge.blackboard.zmq.dispatcher import Dispatcher
from cxbridge.blackboard.zmq.errors import ProtocolError, RequestTimeoutError
from cxbridge.blackboard.zmq.mirror import Mirror
from cxbridge.blackboard.zmq.outbox import Outbox, Pending
from cxbridge.blackboard.zmq.watching import Watching
from cxbridge.interfaces.instance import Interface

if TYPE_CHECKING:
    from cxbridge.blackboard.zmq.client import ZmqBlackBoard

_HEADER: Final = UPDATE_HEADER.size


class Incoming:
    """Instances, mirrors and their session; the one who receives brings the news.

    :param board: the blackboard that it belongs to.
    :param outbox: sends.
    :param dispatcher: calls listeners and observers.
    :param observers: of the blackboard.
    :param warn: called for what people should know.
    """

    def __init__(
        self,
        board: ZmqBlackBoard,
        outbox: Outbox,
        dispatcher: Dispatcher,
        observers: ObserverTable,
        warn: Callable[[str], None],
    ) -> None:
        self._board = board
        self._outbox = outbox
        self._dispatcher = dispatcher
        self._warn = warn
        self._lock = threading.RLock()
        self._mirrors: dict[tuple[str, str], Mirror] = {}
        self._channels: dict[int, Mirror] = {}
        self._instances: dict[bytes, Interface] = {}
        self._unsent: dict[Mirror, bytes] = {}  # what waits to be sent; changes with the outbox locked
        self._epoch = b""
        self._same_epoch = False
        self._reopening = 0
        self._told_lost = False
        self.watching: Final = Watching(observers, dispatcher)
        self.on_connection: list[Callable[[bool], None]] = []
        """Told of a lost session, and of the one after it."""
        self.reason = ""
        """Why the last session ended."""
        self.skipped = 0
        """How many updates were conflated."""
        self.hurry: Callable[[], None] = lambda: None
        """Lets the link call :meth:`flush` soon; set to the link's."""

    # -- instances

    def enter(
        self,
        interface_class: type[Interface],
        interface_id: str,
        owner: str,
        writer: bool,
        queue_limit: int | None,
        frame: Frame,
        listen: Listen | None,
    ) -> Interface:
        """Make the instance that the server has opened."""
        opened = frame.body.opened
        key = (interface_class.SCHEMA.name, interface_id)
        with self._lock:
            mirror = self._mirrors.get(key)
            if mirror is None:
                mirror = self._mirrors[key] = Mirror(
                    interface_class,
                    interface_id,
                    self._board,
                    self._dispatcher,
                    self._board._report_fault,  # noqa: SLF001
                )
                mirror.set_members(opened.members, quietly=True)
            self._connect(mirror, frame)
            if frame.block is not None and opened.seq > mirror.seq:
                if mirror.instances:  # else nobody has missed anything
                    self.skipped += opened.seq - mirror.seq - 1
                self._update(mirror, opened.seq, opened.stamped, opened.changed, frame.block)
            mirror.seq = opened.seq
            instance = interface_class(
                mirror,
                id=interface_id,
                owner=owner,
                serial=UUID(bytes=opened.instance),
                writer=writer,
                queue_limit=queue_limit,
            )
            if listen is not None:
                listen(instance, mirror.listeners)
            mirror.instances.append(instance)
            self._instances[opened.instance] = instance
            return instance

    def _connect(self, mirror: Mirror, frame: Frame) -> None:
        mirror.mem_serial = frame.body.opened.channel
        self._channels[mirror.mem_serial] = mirror

    def owns(self, instance: Interface) -> bool:
        """Return whether an instance was opened here and is open."""
        return self._instances.get(instance.serial.bytes) is instance

    def mirror_of(self, instance: Interface) -> Mirror | None:
        """Return the mirror of an instance that is open here."""
        with self._lock:
            return self._mirrors.get((instance.type, instance.id)) if self.owns(instance) else None

    def start_closing(self, instance: Interface) -> Mirror:
        """Make an instance invalid; its listeners hear of its end still."""
        with self._lock:
            mirror = self._mirrors[instance.type, instance.id]
            del self._instances[instance.serial.bytes]
            instance.invalidate()
            return mirror

    def finish_closing(self, mirror: Mirror, instance: Interface, seq: int) -> None:
        """Strike out an instance that the server has closed."""
        with self._lock:
            if instance in mirror.instances:
                mirror.instances.remove(instance)
            mirror.seq = seq
            if instance.is_writer:
                self._unsent.pop(mirror, None)
                mirror.written = False
            self._drop_if_unused(mirror)
        mirror.end_listening(instance)

    def _drop_if_unused(self, mirror: Mirror) -> None:
        if not mirror.instances:
            if self._mirrors.get(mirror.key) is mirror:
                del self._mirrors[mirror.key]
            if self._channels.get(mirror.mem_serial) is mirror:
                del self._channels[mirror.mem_serial]

    def invalidate_all(self) -> None:
        """End all instances; nobody is told."""
        with self._lock:
            for instance in self._instances.values():
                instance.invalidate()
            self._instances.clear()
            self._mirrors.clear()
            self._channels.clear()

    # -- writing

    def write(self, mirror: Mirror, serial: UUID, stamp: Stamp, changed: bool, block: bytes) -> None:
        """Send a write, or remember that the mirror has one to send."""
        with self._outbox.lock:
            waits = mirror in self._unsent
            sent = self._outbox.write(serial.bytes, stamp, changed, block, wait=not waits)
            self.skipped += waits  # what waited is not sent any more
            if sent:
                mirror.seq += 1
                self._unsent.pop(mirror, None)
                return
            self._unsent[mirror] = block
        self.hurry()

    def flush(self) -> bool:
        """Send what was conflated; return whether there is more."""
        with self._outbox.lock:
            for mirror, block in tuple(self._unsent.items()):
                writer = next((i for i in mirror.instances if i.is_writer and i.valid), None)
                if writer is not None:
                    if not self._outbox.write(writer.serial.bytes, Stamp.NEW, True, block, wait=False):
                        return True  # one Write stands for several
                    mirror.seq += 1
                self._unsent.pop(mirror, None)
        return False

    def wait_written(self, timeout: float) -> None:
        """Return when nothing conflated waits any more.

        :raises RequestTimeoutError: when it takes too long.
        """
        deadline = time.monotonic() + timeout
        while self._unsent:
            if time.monotonic() > deadline:
                raise RequestTimeoutError("the blackboard's server takes no writes")
            time.sleep(0.005)

    # -- the session

    def welcomed(self, epoch: bytes) -> None:
        """Open everything again."""
        self._same_epoch, self._epoch = epoch == self._epoch, epoch
        with self._lock:
            instances = [instance for mirror in self._mirrors.values() for instance in mirror.instances]
            self._channels.clear()
            for mirror in self._mirrors.values():
                mirror.expected = mirror.seq
        instances.sort(key=lambda instance: not instance.is_writer)  # whose data count is known then
        with self._outbox.lock:
            self._reopening = 1
            for instance in instances:
                self._ask_again(instance)
            if self.watching.on:
                self._ask("watch", {}, self.watching.began)
        self._done_one()

    def _ask(self, kind: str, body: dict[str, Any], on_reply: Callable[[Frame], None]) -> None:
        def done(frame: Frame) -> None:
            on_reply(frame)
            self._done_one()

        self._reopening += 1
        self._outbox.start(kind, body, b"", Pending(done))

    def _ask_again(self, instance: Interface) -> None:
        schema = instance.SCHEMA
        body = {
            "type": schema.name,
            "id": instance.id,
            "hash": schema.hash,
            "size": schema.datasize,
            "owner": instance.owner,
            "writer": instance.is_writer,
        }
        self._ask("open", body, lambda frame: self._reopened(instance, frame))

    def _reopened(self, instance: Interface, frame: Frame) -> None:
        """Go on with an instance, or end it."""
        opened = frame.body.opened
        with self._lock:
            mirror = self._mirrors.get((instance.type, instance.id))
            open_here = self._instances.pop(instance.serial.bytes, None) is instance
            if frame.body.code != Code.OK:
                self._give_up(mirror, instance, frame)
            elif mirror is None or not open_here:  # closed meanwhile
                self._close_late(opened.instance)
            else:
                instance.adopt_serial(UUID(bytes=opened.instance))
                self._instances[opened.instance] = instance
                self._connect(mirror, frame)
                if frame.block is not None:
                    self._take_over(mirror, opened, frame.block)
                if instance.is_writer and mirror.written and self._was_lost(mirror, opened.seq):
                    self._unsent[mirror] = mirror.snapshot()
                mirror.seq = opened.seq
                mirror.set_members(opened.members, quietly=False)

    def _take_over(self, mirror: Mirror, opened: Any, block: bytes) -> None:
        """Bring a mirror up to date with a new session's data, unless it is newer."""
        seen = opened.seq <= mirror.expected if self._same_epoch else opened.seq == 0
        if not seen and mirror not in self._unsent:
            self._update(mirror, opened.seq, opened.stamped, opened.changed, block)

    def _was_lost(self, mirror: Mirror, seq: int) -> bool:
        """Return whether what this client wrote last has not reached the server, and nobody wrote since."""
        return seq < mirror.expected if self._same_epoch else seq == 0

    def _give_up(self, mirror: Mirror | None, instance: Interface, frame: Frame) -> None:
        code = Code(frame.body.code).name
        self._warn(f"{instance.uid} of {instance.owner or 'nobody'} could not be opened again: {code}")
        instance.invalidate()
        if mirror is not None:
            if instance in mirror.instances:
                mirror.instances.remove(instance)
            mirror.written = False
            self._unsent.pop(mirror, None)
            mirror.listeners.unregister(None, instance)
            self._drop_if_unused(mirror)

    def _close_late(self, serial: bytes) -> None:
        with self._outbox.lock:
            self._outbox.start("close", {"instance": serial}, b"", Pending())

    def _done_one(self) -> None:
        """Count replies; when all are there, let everybody send."""
        self._reopening -= 1
        if self._reopening:
            return
        with self._outbox.lock:
            self._outbox.set_ready()
            self.flush()
        if self._told_lost:
            self._told_lost = False
            self._warn(f"connected to {self._board.url} again")
            self._tell_connection(True)

    def lost(self, reason: str) -> None:
        """Note that there is no session: nobody else is to be seen."""
        if self._epoch and not self._told_lost:
            self._told_lost = True
            self._warn(f"lost the blackboard at {self._board.url}: {reason}; trying to connect again")
            self._tell_connection(False)
        self.reason = reason
        with self._lock:
            for mirror in self._mirrors.values():
                mirror.forget_others()

    def _tell_connection(self, connected: bool) -> None:
        for callback in tuple(self.on_connection):
            self._dispatcher.put(callback, connected)

    # -- frames

    def updated(self, data: bytes) -> None:
        """Take an Update.

        :raises ProtocolError: when it is none.
        """
        if len(data) < _HEADER or data[1] != VERSION:
            raise other_version(data[1]) if len(data) > 1 else ProtocolError("an update without its header")
        _, _, stamped, changed, channel, seq, skipped = UPDATE_HEADER.unpack_from(data)
        with self._lock:
            mirror = self._channels.get(channel)
            if mirror is None or seq <= mirror.seq:
                return
            if seq != mirror.seq + 1 + skipped:
                raise ProtocolError("updates were lost")
            self.skipped += skipped
            if len(data) != _HEADER + mirror.size:
                raise _wrong_size(mirror, data[_HEADER:])
            mirror.update(seq, data[_HEADER:], stamped, changed)

    def received(self, frame: Frame) -> None:
        """Take a frame of the server that is no update."""
        body = frame.body
        match frame.kind:
            case "answer":
                self._outbox.answer(frame)
            case "reply":
                if not self._outbox.answer(frame) and body.HasField("opened"):
                    self._close_late(body.opened.instance)  # nobody waits for it any more
            case "change":
                mirror = self._channels.get(body.channel)
                if mirror is not None and body.kind in set(Kind) - {Kind.NONE}:
                    mirror.change(Kind(body.kind), UUID(bytes=body.instance), body.owner)
            case "deliver":
                self._dispatcher.put(self._deliver, body, frame.block, urgent=True)
            case "existence":
                self.watching.existence(body)
            case _:
                pass  # a beat, or news of a later version

    def _update(self, mirror: Mirror, seq: int, stamped: bool, changed: bool, block: bytes) -> None:
        if len(block) != mirror.size:
            raise _wrong_size(mirror, block)
        mirror.update(seq, block, stamped, changed)

    def _deliver(self, body: Deliver, block: bytes) -> None:
        """Put a message into a writer's queue and tell the server; in the dispatcher's thread."""
        code, detail = self._queue_message(body, block)
        self._outbox.tell_delivered(Delivered(body.delivery, code, detail))

    def _queue_message(self, body: Deliver, block: bytes) -> tuple[Code, int]:
        instance = self._instances.get(body.instance)
        mirror = None if instance is None else self.mirror_of(instance)
        if instance is None or mirror is None or not instance.is_writer:
            return Code.NO_WRITER, 0
        message_class = instance.MESSAGES.get(body.type)
        if message_class is None or len(block) != message_class.SCHEMA.datasize:
            return Code.UNKNOWN_MESSAGE, 0
        message = receive(message_class, body, block, body.sender, mirror.mem_serial)
        if not mirror.listeners.accept(message):
            return Code.DECLINED, 0
        try:
            instance.msgq_append(message)
        except QueueFullError as error:
            return Code.QUEUE_FULL, error.limit
        except InvalidInstanceError:  # a listener has closed it
            return Code.NO_WRITER, 0
        return Code.OK, 0


def _wrong_size(mirror: Mirror, block: bytes) -> ProtocolError:
    return ProtocolError(f"a block of {mirror.uid} has not {len(block)} bytes")
