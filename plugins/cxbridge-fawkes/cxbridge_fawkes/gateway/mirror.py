"""The mirror of one interface, from the start to the end of its writer.

The source is the writer's board, the target the other board. The mirror copies blocks from the source to the
target, where it is the writer, and messages from the target to the source. On the source, it has a reading
instance (a proxy) for each sender, so that the writer can distinguish the senders.
"""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from contextlib import ExitStack, suppress
from typing import Final
from uuid import UUID

from cxbridge.blackboard import BlackBoard, EventKind, Listener, listening
from cxbridge.blackboard.exclusive_control import (
    ACQUIRE_MESSAGE,
    RELEASE_MESSAGE,
    describe_controller,
    skip_stale_ids,
    write_final_block,
)
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.message import Message
from cxbridge_fawkes.gateway.translation import BlockTranslator

OWNER: Final = "gateway"
"""The owner of a gateway's instances."""

# more than 8 s of writes of a Fawkes, whose main loop runs 30 times a second
MAX_BLOCKS: Final = 256
"""The maximum number of queued blocks for a slow target; further blocks replace the oldest."""

# about as many as the queue of a writer holds by default
MAX_MESSAGES: Final = 1000
"""The number of queued messages and ends of senders from which the mirror refuses further messages."""

# each proxy is an open instance on the source, and a robot has few agents and operators
MAX_PROXIES: Final = 64
"""The maximum number of proxies; a further sender replaces the sender that was silent for longest."""


class SenderProxy:
    """Sends messages for one sender, so that ids are counted per sender.

    The writer sees the proxy's instance as the sender. When the instance ends, closed by the gateway or with
    its connection, the writer revokes its control.

    :param instance: a reading instance on the writer's board, which the proxy closes.
    """

    def __init__(self, instance: Interface) -> None:
        self._instance = instance
        self.may_control = False
        """Whether the sender has requested exclusive control and not released it."""

    @property
    def serial(self) -> UUID:
        return self._instance.serial

    def send(self, message: Message) -> int:
        """Send a copy of a message; return the id of the copy.

        If the interface has exclusive control, the id differs from the id that the writer shows, so that the
        sender recognises its own outcome.

        :raises BlackBoardError: if the message cannot be delivered.
        """
        copy = self._instance.create_message(message.type)
        copy.set_from_chunk(message.to_bytes())
        skip_stale_ids(self._instance, may_control=self.may_control)
        if message.type in (ACQUIRE_MESSAGE, RELEASE_MESSAGE):
            self.may_control = message.type == ACQUIRE_MESSAGE
        return self._instance.msgq_enqueue(copy)

    def close(self, controller: str) -> None:
        """Release control that the sender has or may get, and close the instance.

        :param controller: the serial of the controller that the writer shows; empty without a controller,
            also while an AcquireControlMessage of the sender waits at the writer.
        """
        with suppress(BlackBoardError):  # the writer may be lost, and with it the control
            if self.may_control and controller in ("", str(self.serial)):
                self._instance.msgq_enqueue(self._instance.create_message(RELEASE_MESSAGE))
        with suppress(BlackBoardError):  # the blackboard may be gone already
            self._instance.close()


class InterfaceMirror(Listener):
    """Mirrors the writes of the source to the target, and messages back.

    The mirror listens to data and to the end of the writer on the source, and to messages and to the ends of
    readers on the target. The listeners fill queues in any thread; :meth:`transfer` empties them in the
    gateway's thread.

    :param side: the index of the source among the gateway's boards.
    :param wake: called in any thread when a block, a message or the end of a sender is queued.
    :param request_sweep: called in any thread when the mirror must end.
    :param warn: called with warnings.
    :param orphans: serials of closed proxies of earlier mirrors. A writer that was disconnected may have
        missed their end, and show an orphan as its controller.
    :param hide_past: see :class:`~cxbridge_fawkes.gateway.gateway.Gateway`.
    :raises CxbridgeError: if the interface cannot be opened on both boards, or its layouts differ.
    """

    def __init__(  # noqa: PLR0913 - all further arguments are passed by name
        self,
        source: BlackBoard,
        target: BlackBoard,
        interface_type: str,
        interface_id: str,
        side: int,
        orphans: deque[str],
        *,
        wake: Callable[[], None],
        request_sweep: Callable[[], None],
        warn: Callable[[str], None],
        hide_past: bool,
    ) -> None:
        self.side: Final = side
        self.end_reason = ""
        """The reason why the mirror must end; empty if it can continue."""
        self._source = source
        self._wake, self._request_sweep, self._warn = wake, request_sweep, warn
        self._lock = threading.Lock()  # guards the reader
        self._blocks: deque[bytes] = deque(maxlen=MAX_BLOCKS)
        # messages, and the serials of senders that have ended, in order of arrival
        self._requests: deque[Message | UUID] = deque()
        self._proxies: OrderedDict[UUID, SenderProxy] = OrderedDict()
        self._orphans: Final = orphans
        source_kinds = (EventKind.DATA_REFRESHED, EventKind.WRITER_REMOVED)
        target_kinds = (EventKind.MESSAGE_RECEIVED, EventKind.READER_REMOVED)
        with ExitStack() as stack:
            self._reader = source.open_for_reading(
                interface_type, interface_id, owner=OWNER, listen=listening(self, *source_kinds)
            )
            stack.callback(self._reader.close)
            self._writer = target.open_for_writing(
                interface_type,
                interface_id,
                owner=OWNER,
                queue_limit=0,  # the mirror never reads this queue, so no message may wait in it
                listen=listening(self, *target_kinds),
            )
            stack.callback(self._writer.close)
            _check_layouts(self._reader, self._writer)
            self._writer.read()  # the readers may still have the last block of an earlier writer
            self._last_block = self._writer.to_bytes()
            self._translator = BlockTranslator(
                type(self._reader), hide_state=hide_past, find_sender_serial=self._find_sender_serial
            )
            self.data_refreshed(self._reader)
            self._open_instances = stack.pop_all()

    def close(self, reason: str) -> None:
        """Write a final block, deliver the accepted messages and close the instances on both boards.

        After the end of the writer, or an error while blocks are mirrored, messages are dropped.

        :param reason: the error text of a running call in the final block.
        """
        with suppress(BlackBoardError):  # first, because readers wait for it and the source may reply slowly
            write_final_block(self._writer, reason)
        with suppress(BlackBoardError):  # the blackboard may be gone already, and with it the instance
            self._writer.close()
        self._process_requests()
        for proxy in self._proxies.values():
            if proxy.may_control:  # a disconnected writer misses the end of the proxy
                self._orphans.append(str(proxy.serial))
            proxy.close(self._read_controller())
        self._proxies.clear()
        with suppress(BlackBoardError):  # the instance may be gone with its blackboard
            self._open_instances.close()

    def data_refreshed(self, interface: Interface) -> None:
        """Queue the present block of the source, unless the newest queued block is the same."""
        with self._lock:
            interface.read()
            block = interface.to_bytes()
            if not self._blocks or self._blocks[-1] != block:
                self._blocks.append(block)
        self._wake()

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - a listener's signature
        """Queue a message for the writer; return False, or True if the mirror's queue is full."""
        if len(self._requests) >= MAX_MESSAGES:
            return True  # to the target's queue, which refuses the message by its limit of 0
        self._requests.append(message.copy())
        self._wake()
        return False

    def reader_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - as above
        """Queue the end of a sender behind its messages."""
        self._requests.append(serial)
        self._wake()

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - as above
        self._request_end("its writer is gone")

    def _request_end(self, reason: str) -> None:
        """Request the end of the mirror. The first reason counts."""
        if not self.end_reason:
            self.end_reason = reason
        self._request_sweep()

    def transfer(self) -> None:
        """Process all queued blocks, then all queued messages and ends of senders, each oldest first."""
        try:
            while self._blocks and not self.end_reason:
                self._write_block(self._blocks.popleft())
        except BlackBoardError as error:
            self._request_end(f"its data cannot be mirrored: {error.message}")
        self._process_requests()

    def _process_requests(self) -> None:
        while self._requests and not self.end_reason:
            request = self._requests.popleft()
            if isinstance(request, Message):
                try:
                    self._forward_message(request)
                except BlackBoardError as error:
                    self._warn(f"{request.type} cannot be delivered: {error.message}")
            elif (proxy := self._proxies.pop(request, None)) is not None:
                proxy.close(self._read_controller())

    def _write_block(self, block: bytes) -> None:
        """Write a block to the target with its time stamp, unless the block has nothing new for readers."""
        controller = self._translator.read_controller(block)
        self._release_orphan(controller)
        if any(proxy.may_control for proxy in self._proxies.values()):
            self._warn_of_foreign_controller(controller)
        block = self._translator.translate(block)
        if block == self._last_block:
            return
        has_changed = block[STAMP.size :] != self._last_block[STAMP.size :]
        if not has_changed and self._translator.hides_state:
            return  # the writer works for senders that are not the gateway's, which the translator hides
        self._last_block = block
        self._writer.set_from_chunk(block)
        if has_changed:
            self._writer.mark_data_changed()
        self._writer.write()

    def _forward_message(self, message: Message) -> None:
        """Send a message to the writer on behalf of its original sender."""
        sender = message.source_id
        assert sender is not None  # set when the message was sent
        proxy = self._proxies.get(sender)
        if proxy is None:
            instance = self._source.open_for_reading(self._writer.type, self._writer.id, owner=OWNER)
            proxy = self._proxies[sender] = SenderProxy(instance)
            if len(self._proxies) > MAX_PROXIES:  # the first proxy was silent for longest
                self._proxies.popitem(last=False)[1].close(self._read_controller())
        self._proxies.move_to_end(sender)
        if message.type == ACQUIRE_MESSAGE and not message.get("steal_control"):
            self._warn_of_foreign_controller(self._read_controller())
        writer_id = proxy.send(message)
        self._translator.record_ids(message.type, writer_id, message.id)

    def _release_orphan(self, controller: str) -> None:
        """Release the control of the writer's controller, if it is an orphan."""
        if controller in self._orphans:
            self._orphans.remove(controller)
            message = self._reader.create_message(RELEASE_MESSAGE)
            # sets only the source, which proxy=True keeps: the writer takes the message for the orphan's.
            # msgq_enqueue sets the id and the recipient
            message.address(0, 0, self._reader.serial, UUID(controller))
            self._reader.msgq_enqueue(message, proxy=True)

    def _warn_of_foreign_controller(self, controller: str) -> None:
        """Warn of a controller that is not a proxy of this mirror."""
        if controller and self._find_sender_serial(controller) is None:
            self._warn(f"{describe_controller(self._reader, controller)} has control")

    def _read_controller(self) -> str:
        """Return the serial of the writer's controller; empty without a controller."""
        with self._lock:
            return self._translator.read_controller(self._reader.to_bytes())

    def _find_sender_serial(self, proxy_serial: str) -> str | None:
        """Return the serial of the sender for which a proxy sends; None if the mirror has no such proxy."""
        proxies = self._proxies.items()
        return next((str(sender) for sender, proxy in proxies if proxy_serial == str(proxy.serial)), None)


def _check_layouts(reader: Interface, writer: Interface) -> None:
    """Refuse an interface whose fields, or the sizes of whose messages, differ on the two boards.

    :raises BlackBoardError: if the layouts differ.
    """
    source_layout, target_layout = (
        (
            [(field.name, field.type, field.length, field.offset) for field in instance.SCHEMA.fields],
            {message.name: message.datasize for message in instance.SCHEMA.messages},
        )
        for instance in (reader, writer)
    )
    if source_layout != target_layout:
        raise BlackBoardError(
            f"the layouts of {reader.uid} on the two blackboards differ",
            hint="both sides must use the same definition; the hashes are "
            f"{reader.SCHEMA.hash_printable} and {writer.SCHEMA.hash_printable}",
        )
