"""Forwards writes of a blackboard's interfaces to an event bus; see docs/recording.md.

The forwarder opens each matching interface for reading and follows it: the interface is closed when it has no
writer and no other reader. Listeners of the blackboard must not open interfaces: they leave this task to
`poll`.
"""

from __future__ import annotations

import queue
import threading
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Final
from uuid import UUID

from cxbridge.blackboard import BlackBoard, EventKind, Listener, Observer, listening
from cxbridge.blackboard.names import parse_uid
from cxbridge.blackboard.patterns import Pattern, escape_glob
from cxbridge.clock import join_us
from cxbridge.errors import BlackBoardError, CxbridgeError
from cxbridge.events import BlockWrite, Event, EventBus, InterfaceWrite, SkillStatus
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.interfaces.schema import InterfaceSchema
from cxbridge.trace.formats.block_decoder import block_events

COMPONENT: Final = "Recorder"
"""The name of a forwarder in log lines and as owner of interfaces."""

InterfaceKey = tuple[str, str]
"""The type and id of an interface."""

_RECHECK_DELAY_S: Final = 5.0  # after a reconnection, interfaces reappear one by one
_MAX_STAMP_US: Final = 1 << 53  # in the year 2255; larger values are not times, and may exceed mcap's range


@dataclass(frozen=True, slots=True)
class ConnectionGap:
    """A time without a connection to the blackboard.

    :param start_us: the start in microseconds since the epoch.
    :param seconds: the length.
    """

    start_us: int
    seconds: float


@dataclass(slots=True)
class _FollowedInterface:
    """An interface that the forwarder has open.

    :param published_block: the block read when the listener was registered, which the listener may get again;
        None before that reading, and after the first other block.
    """

    instance: Interface
    published_block: bytes | None = None


class WriteForwarder(Listener, Observer):
    """Publishes the writes of matching interfaces of a blackboard on a bus, including later interfaces.

    Listeners emit in any thread, one at a time. Interfaces are opened and closed in the thread that calls
    `start`, `poll` and `close`.

    :param board: not closed by the forwarder.
    :param patterns: the patterns of the forwarded interfaces.
    :param bus: gets each write as BlockWrite, and as InterfaceWrite and SkillStatus, as far as the bus has
        subscribers for these events.
    """

    def __init__(self, board: BlackBoard, patterns: Iterable[Pattern], bus: EventBus) -> None:
        self.is_enabled = True
        """Whether writes are published or ignored."""
        self.write_counts: dict[str, int] = {}
        """The number of published writes by ``Type::id``."""
        self.gaps: list[ConnectionGap] = []
        """The times without a connection."""
        self._board: Final = board
        self._patterns: Final = tuple(patterns)
        self._bus: Final = bus
        self._log: Final = bus.logger(COMPONENT)
        self._poll_tasks: queue.SimpleQueue[Callable[[], None]] = queue.SimpleQueue()  # executed by `poll`
        self._lock = threading.Lock()  # guards the publishing of events and the copies of the instances
        self._followed: dict[InterfaceKey, _FollowedInterface] = {}
        self._uids_from_bus: set[str] = set()
        self._schemas: dict[str, InterfaceSchema | None] = {}
        self._refused_keys: set[InterfaceKey] = set()  # whose opening failed, which is logged once
        # the start of the present loss by the blackboard's clock, and by the monotonic clock
        self._lost_since: tuple[int, float] | None = None
        self._recheck_due_s: float | None = None

    def start(self) -> int:
        """Start listening; return the number of opened interfaces.

        :raises BlackBoardError: if the blackboard cannot be queried.
        """
        self._board.add_connection_callback(self._handle_connection_change)
        if self._board.reports_writes and self._board.bus is not None:
            self._board.bus.subscribe(self._on_block_write, BlockWrite)
        for pattern in self._patterns:
            self._board.register_observer(self, pattern.type_glob, pattern.id_glob)
        self._open_matching(is_later=False)
        return len(self._followed)

    def poll(self, timeout_s: float) -> None:
        """Open new and close unused interfaces.

        :param timeout_s: the limit in seconds of the wait for the first task.
        """
        # listeners are called in any thread, often with locks of the blackboard: interfaces may be opened
        # only here
        with suppress(queue.Empty):  # no task within the timeout, or no further task
            self._poll_tasks.get(timeout=timeout_s)()
            while True:
                self._poll_tasks.get_nowait()()
        if self._recheck_due_s is not None and time.monotonic() >= self._recheck_due_s:
            self._recheck_due_s = None
            for key in tuple(self._followed):
                self._open_or_close(key)

    def wake(self) -> None:
        """Make `poll` return; callable from any thread and from signal handlers."""
        self._poll_tasks.put(lambda: None)

    def close(self) -> None:
        """Publish the writes received so far, and close the instances."""
        self._board.unregister_observer(self)
        if self._board.connected:
            with suppress(BlackBoardError):  # the connection may be lost just now
                self._board.flush()
        elif self._lost_since is not None:  # the present loss is a gap, too
            self._handle_connection_change(True)
        if self._board.bus is not None:
            self._board.bus.unsubscribe(self._on_block_write)
        with self._lock:
            self.is_enabled = False
        for followed_interface in self._followed.values():
            with suppress(BlackBoardError):  # the blackboard may be gone already
                followed_interface.instance.close()
        self._followed.clear()

    def _reopen_after_loss(self) -> None:
        """Open the interfaces that appeared while there was no connection."""
        self._recheck_due_s = time.monotonic() + _RECHECK_DELAY_S
        with suppress(BlackBoardError):  # the connection is lost again
            self._open_matching(is_later=True)

    def _open_matching(self, *, is_later: bool) -> None:
        """Open all matching interfaces that are not open."""
        for pattern in self._patterns:
            for interface in self._board.list(pattern.type_glob, pattern.id_glob):
                self._open(interface.type, interface.id, is_later=is_later)

    def _open_or_close(self, key: InterfaceKey) -> None:
        """Open a new interface, or close an interface that only the forwarder has open.

        Without a connection, and shortly after its return, the check is postponed, because interfaces
        reappear one by one.
        """
        if not self._board.connected or (self._recheck_due_s is not None and key in self._followed):
            return
        with suppress(BlackBoardError):  # the connection may be lost just now; then another check follows
            followed_interface = self._followed.get(key)
            if followed_interface is not None and followed_interface.instance.valid:
                if followed_interface.instance.has_writer or followed_interface.instance.num_readers > 1:
                    return
                self._close(key)
            if self._board.list(*map(escape_glob, key)):
                self._open(*key, is_later=True)

    def _close(self, key: InterfaceKey) -> None:
        instance = self._followed.pop(key).instance
        self._uids_from_bus.discard(instance.uid)
        self._log.debug(f"{instance.uid} is gone")
        instance.close()

    def _open(self, interface_type: str, interface_id: str, *, is_later: bool) -> None:
        """Follow an interface.

        :param is_later: whether the interface appeared after the start, so that its data are a new write.
        """
        key = (interface_type, interface_id)
        former_interface = self._followed.get(key)
        if former_interface is not None and former_interface.instance.valid:
            return
        try:
            instance = self._board.open_for_reading(
                interface_type,
                interface_id,
                owner=COMPONENT,
                listen=listening(self, EventKind.WRITER_REMOVED, EventKind.READER_REMOVED),
            )
        except CxbridgeError as error:
            if self._board.connected and key not in self._refused_keys:
                self._refused_keys.add(key)
                self._log.warn(f"{interface_type}::{interface_id} cannot be recorded: {error}")
            return
        followed_interface = self._followed[key] = _FollowedInterface(instance)
        with self._lock:
            instance.read()
            # the blackboard's bus may have reported the write before this interface was opened
            if is_later and instance.uid not in self._uids_from_bus:
                self._publish(instance.SCHEMA, instance.uid, instance.to_bytes())
        if not self._board.reports_writes:
            self._board.register_listener(self, instance, EventKind.DATA_REFRESHED)
            with self._lock:
                # a write between the first reading and the registration has reached no listener
                if instance.read():
                    followed_interface.published_block = instance.to_bytes()
                    self._publish(instance.SCHEMA, instance.uid, followed_interface.published_block)
        self._log.info(f"Recording {instance.uid}")

    def data_refreshed(self, interface: Interface) -> None:
        """Publish a write."""
        followed_interface = self._followed.get((interface.type, interface.id))
        with self._lock:
            if followed_interface is None or not interface.valid:
                return  # the interface is being closed
            try:
                interface.read()
            except BlackBoardError:  # the connection is lost, which `_handle_connection_change` reports
                return
            block = interface.to_bytes()
            if block != followed_interface.published_block:
                followed_interface.published_block = None
                self._publish(interface.SCHEMA, interface.uid, block)

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - a listener's signature
        """Schedule a check, as the interface may be unused."""
        self._poll_tasks.put(partial(self._open_or_close, (interface.type, interface.id)))

    def reader_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - a listener's signature
        """Schedule a check, as the interface may be unused."""
        self._poll_tasks.put(partial(self._open_or_close, (interface.type, interface.id)))

    def interface_created(self, interface_type: str, interface_id: str) -> None:
        """Schedule the opening of a new interface."""
        self._poll_tasks.put(partial(self._open_or_close, (interface_type, interface_id)))

    def _on_block_write(self, event: Event) -> None:
        """Publish a write from the blackboard's bus."""
        assert isinstance(event, BlockWrite)
        with self._lock:
            if event.uid not in self._schemas:
                self._schemas[event.uid] = self._find_schema(event.uid)
            schema = self._schemas[event.uid]
            if schema is not None and len(event.block) == schema.datasize:
                self._uids_from_bus.add(event.uid)
                self._publish(schema, event.uid, event.block)

    def _find_schema(self, uid: str) -> InterfaceSchema | None:
        """Return the definition of an interface; None for an interface that is not recorded."""
        interface_type, _ = key = parse_uid(uid)
        if not any(pattern.matches(key) for pattern in self._patterns):
            return None
        with suppress(CxbridgeError):  # opening the interface reports the error
            return self._board.registry.get(interface_type).SCHEMA
        return None

    def _handle_connection_change(self, connected: bool) -> None:
        if not connected:
            self._lost_since = (self._board.clock.now_us(), time.monotonic())
        elif self._lost_since is not None:
            (start_us, lost_s), self._lost_since = self._lost_since, None
            gap = ConnectionGap(start_us, time.monotonic() - lost_s)
            self.gaps.append(gap)
            self._log.warn(f"A gap: the connection to the blackboard was lost for {gap.seconds:.2f} s")
            self._poll_tasks.put(self._reopen_after_loss)

    def _publish(self, schema: InterfaceSchema, uid: str, block: bytes) -> None:
        """Count a write and emit its events."""
        # an interface that was never written has only zeros
        if not self.is_enabled or not any(block):
            return
        self.write_counts[uid] = self.write_counts.get(uid, 0) + 1
        now_us = self._board.clock.now_us()
        if self._bus.wants(BlockWrite):
            self._bus.emit(BlockWrite(now_us, uid, schema.hash, block))
        if self._bus.wants(InterfaceWrite) or self._bus.wants(SkillStatus):
            stamp_us = join_us(*STAMP.unpack_from(block))
            time_us = stamp_us if 0 < stamp_us < _MAX_STAMP_US else now_us
            for event in block_events(schema, uid, time_us, block):
                self._bus.emit(event)
