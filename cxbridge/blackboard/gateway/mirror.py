"""The mirror of one interface during the life of its writer.

Blocks go from the writer's board, the source, to the other board, the target; messages go back. On the
target the gateway is the writer. On the source it has a reading instance for each sender, so that the writer
can distinguish the senders.
"""

from __future__ import annotations

import threading
from collections import OrderedDict, deque
from collections.abc import Callable
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from typing import Final
from uuid import UUID

from cxbridge.blackboard import BlackBoard, EventKind, Listener, listening
from cxbridge.blackboard.exclusive_control import (
    ACQUIRE,
    RELEASE,
    name_controller,
    skip_stale_ids,
    write_farewell,
)
from cxbridge.blackboard.gateway.translation import StateTranslator
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.message import Message

OWNER: Final = "gateway"
"""The owner of a gateway's instances."""

MAX_BLOCKS: Final = 256
"""The maximum number of queued blocks for the slower board; further blocks replace the oldest."""

MAX_MESSAGES: Final = 1000
"""The maximum number of queued messages; further ones are refused."""

# each proxy is an open instance on the source; agents and operators are few
MAX_PROXIES: Final = 64
"""The maximum number of separate senders; the one silent for longest is dropped."""


@dataclass(frozen=True, slots=True)
class Hooks:
    """Callbacks of a mirror, called in any thread.

    :param wake: called when data are queued.
    :param sweep: called when the mirror must end.
    :param warn: called with warnings.
    """

    wake: Callable[[], None]
    sweep: Callable[[], None]
    warn: Callable[[str], None]


class SenderProxy:
    """Sends messages for one sender, so that ids are counted per sender.

    The writer sees an instance of the gateway as the source. When that instance is closed, by the gateway or
    a lost connection, the writer revokes its control.

    :param instance: a reading instance on the writer's board, closed with the proxy.
    """

    def __init__(self, instance: Interface) -> None:
        self._instance = instance
        self.may_control = False
        """Whether the sender has requested exclusive control and not released it."""

    @property
    def serial(self) -> UUID:
        return self._instance.serial

    def send(self, message: Message) -> int:
        """Send a copy of a message; return its id, which differs from the one shown by the writer.

        :raises BlackBoardError: if delivery fails.
        """
        twin = self._instance.create_message(message.type)
        twin.set_from_chunk(message.to_bytes())
        skip_stale_ids(self._instance, controls=self.may_control)
        if message.type in (ACQUIRE, RELEASE):
            self.may_control = message.type == ACQUIRE
        return self._instance.msgq_enqueue(twin)

    def close(self, controller: str) -> None:
        """Release control that the sender has or may get, and close the instance.

        :param controller: the known serial of the controller, or empty.
        """
        with suppress(BlackBoardError):  # a lost writer has lost its controller, too
            if self.may_control and controller in ("", str(self.serial)):
                self._instance.msgq_enqueue(self._instance.create_message(RELEASE))
        with suppress(BlackBoardError):  # the blackboard may be gone already
            self._instance.close()


class InterfaceMirror(Listener):
    """Mirrors the writes of one board to the other, and messages back.

    It listens to data and the end of the writer on the source, and to messages and the ends of readers on the
    target.

    Listeners fill queues in any thread; :meth:`carry` empties them in one thread.

    :param side: the number of the source, for the owner.
    :param hooks: the callbacks to the gateway.
    :param orphans: serials of closed instances of earlier mirrors. A disconnected writer may not know that
        they are closed, and show one as its controller.
    :param hide_past: see :class:`~cxbridge.blackboard.gateway.gateway.Gateway`.
    :raises CxbridgeError: if the interface cannot be opened on both boards, or its layouts differ.
    """

    def __init__(
        self,
        source: BlackBoard,
        target: BlackBoard,
        interface_type: str,
        interface_id: str,
        side: int,
        hooks: Hooks,
        orphans: deque[str],
        *,
        hide_past: bool = False,
    ) -> None:
        self.side: Final = side
        self.ended = ""
        """Why the mirror must end; else empty."""
        self.writes = 0
        self.sent = 0
        self._source = source
        self._hooks = hooks
        self._lock = threading.Lock()  # guards the reader
        self._blocks: deque[bytes] = deque(maxlen=MAX_BLOCKS)
        self._requests: deque[Message | UUID] = deque()
        self._proxies: OrderedDict[UUID, SenderProxy] = OrderedDict()
        self._orphans: Final = orphans
        kinds = (EventKind.DATA_REFRESHED, EventKind.WRITER_REMOVED)
        with ExitStack() as stack:
            self._reader = source.open_for_reading(
                interface_type, interface_id, owner=OWNER, listen=listening(self, *kinds)
            )
            stack.callback(self._reader.close)
            kinds = (EventKind.MESSAGE_RECEIVED, EventKind.READER_REMOVED)
            self._writer = target.open_for_writing(
                interface_type,
                interface_id,
                owner=OWNER,
                queue_limit=0,  # no message may be queued there, because nothing would remove it
                listen=listening(self, *kinds),
            )
            stack.callback(self._writer.close)
            _check_layouts(self._reader, self._writer)
            self._writer.read()  # continue with the last block of an earlier writer, which readers have
            self._last_block = self._writer.to_bytes()
            self._translator = StateTranslator(type(self._reader), hide=hide_past, sender_of=self._sender_of)
            self.data_refreshed(self._reader)
            self._stack = stack.pop_all()

    def close(self, reason: str) -> None:
        """Close the instances on both boards."""
        with suppress(BlackBoardError):  # first, because readers see it and the source may reply slowly
            write_farewell(self._writer, reason)
        with suppress(BlackBoardError):  # the blackboard may be gone already, and with it the instance
            self._writer.close()
        self._carry_requests()  # the messages that the mirror has accepted
        for proxy in self._proxies.values():
            if proxy.may_control:  # a disconnected writer would miss that the instance is closed
                self._orphans.append(str(proxy.serial))
            proxy.close(self._controller())
        self._proxies.clear()
        with suppress(BlackBoardError):  # the instance may be gone with its blackboard
            self._stack.close()

    def data_refreshed(self, interface: Interface) -> None:
        """Queue the present block of the source."""
        with self._lock:
            interface.read()
            block = interface.to_bytes()
            if not self._blocks or self._blocks[-1] != block:
                self._blocks.append(block)
        self._hooks.wake()

    def message_received(self, interface: Interface, message: Message) -> bool:  # noqa: ARG002 - a listener's signature
        """Queue a message for the writer; without room the target's queue refuses it, by its limit of 0."""
        if len(self._requests) >= MAX_MESSAGES:
            return True
        self._requests.append(message.copy())
        self._hooks.wake()
        return False

    def reader_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        """Queue the end of a sender, after its messages."""
        self._requests.append(serial)
        self._hooks.wake()

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._request_end("its writer is gone")

    def _request_end(self, reason: str) -> None:
        """Request the end of the mirror."""
        if not self.ended:
            self.ended = reason
        self._hooks.sweep()

    def carry(self) -> None:
        """Process all queued blocks and messages, oldest first."""
        try:
            while self._blocks and not self.ended:
                self._write(self._blocks.popleft())
        except BlackBoardError as error:
            self._request_end(f"the other side does not take its data: {error.message}")
        self._carry_requests()

    def _carry_requests(self) -> None:
        while self._requests and not self.ended:
            request = self._requests.popleft()
            if isinstance(request, Message):
                try:
                    self._forward(request)
                except BlackBoardError as error:
                    self._hooks.warn(f"{request.type} cannot be delivered: {error.message}")
            elif (proxy := self._proxies.pop(request, None)) is not None:
                proxy.close(self._controller())

    def _write(self, block: bytes) -> None:
        """Write a block on the other board with its time stamp."""
        controller = self._translator.controller(block)
        self._release_orphan(controller)
        if any(proxy.may_control for proxy in self._proxies.values()):
            self._warn_of(controller)
        block = self._translator.translate(block)
        if block == self._last_block:
            return  # readers would see no difference
        changed = block[STAMP.size :] != self._last_block[STAMP.size :]
        if not changed and self._translator.hides:
            return  # an update for other senders: their work and its times are hidden
        self._last_block = block
        self._writer.set_from_chunk(block)
        if changed:
            self._writer.mark_data_changed()
        self._writer.write()
        self.writes += 1

    def _forward(self, message: Message) -> None:
        """Send a message to the writer on behalf of its original sender."""
        source = message.source_id
        assert source is not None  # set by the queue that the message came through
        proxy = self._proxies.get(source)
        if proxy is None:
            instance = self._source.open_for_reading(self._writer.type, self._writer.id, owner=OWNER)
            proxy = self._proxies[source] = SenderProxy(instance)
            if len(self._proxies) > MAX_PROXIES:
                self._proxies.popitem(last=False)[1].close(self._controller())
        self._proxies.move_to_end(source)
        if message.type == ACQUIRE and not message.get("steal_control"):
            self._warn_of(self._controller())
        writer_id = proxy.send(message)
        self.sent += 1
        self._translator.record(message.type, writer_id, message.id)

    def _release_orphan(self, controller: str) -> None:
        """Send ReleaseControl for a closed controller if the writer missed its end."""
        if controller in self._orphans:
            self._orphans.remove(controller)
            message = self._reader.create_message(RELEASE)
            message.address(0, 0, self._reader.serial, UUID(controller))
            self._reader.msgq_enqueue(message, proxy=True)

    def _warn_of(self, controller: str) -> None:
        """Warn of a controller that is not a sender of this gateway."""
        if controller and self._sender_of(controller) is None:
            self._hooks.warn(f"{name_controller(self._reader, controller)} has control")

    def _controller(self) -> str:
        """Return the serial of the writer's exclusive controller, or empty."""
        with self._lock:
            return self._translator.controller(self._reader.to_bytes())

    def _sender_of(self, serial: str) -> str | None:
        for source, proxy in self._proxies.items():
            if serial == str(proxy.serial):
                return str(source)
        return None


def _check_layouts(reader: Interface, writer: Interface) -> None:
    """Refuse an interface whose blocks or messages have different layouts on the two boards."""
    ours = [(f.name, f.type, f.length, f.offset) for f in reader.SCHEMA.fields]
    theirs = [(f.name, f.type, f.length, f.offset) for f in writer.SCHEMA.fields]
    sizes = [
        {message.name: message.datasize for message in instance.SCHEMA.messages}
        for instance in (reader, writer)
    ]
    if ours != theirs or sizes[0] != sizes[1]:
        raise BlackBoardError(
            f"{reader.uid} has another layout on the other blackboard",
            hint="both sides need the same definition; hashes are "
            f"{reader.SCHEMA.hash_printable} and {writer.SCHEMA.hash_printable}",
        )
