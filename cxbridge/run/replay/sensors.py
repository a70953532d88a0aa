"""Replay of the interface writes of sensors and other programs, at their recorded times."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping

from cxbridge.blackboard import LocalBlackBoard
from cxbridge.blackboard.base import OpenRequest
from cxbridge.blackboard.names import parse_uid
from cxbridge.errors import CxbridgeError, InterfaceDefinitionError, InterfaceError
from cxbridge.events import InterfaceWrite, Logger
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.mainloop import Hook
from cxbridge.run.components.component import Component
from cxbridge.trace.replay.block_maker import BlockMaker

OWNER = "cxbridge replay"
"""The owner of the writers that replay a recording."""


class YieldingBoard(LocalBlackBoard):
    """A blackboard where a replay's writer releases an interface to the run's own writer."""

    release: Callable[[tuple[str, str]], None] | None = None
    """Called with type and id before another client opens an interface for writing; None without a replay."""

    def _open(self, request: OpenRequest) -> Interface:
        if request.is_writer and self.release is not None and request.owner != OWNER:
            self.release(request.key)
        return super()._open(request)


class SensorPlayer(Component):
    """Replays interface writes before the executive thinks.

    :param first_writes: the first write of each interface by ``Type::id``.
    :param writes: the writes in the order of their times, by the run's clock.
    :raises TraceError: if an interface definition has changed since the recording.
    :raises InterfaceDefinitionError: if an interface definition is wrong.
    """

    hooks = (Hook.SENSOR_ACQUIRE,)

    def __init__(
        self,
        board: YieldingBoard,
        log: Logger,
        first_writes: Mapping[str, InterfaceWrite],
        writes: Iterable[InterfaceWrite],
    ) -> None:
        self._board, self._log = board, log
        # by type and id of the interface; the bytes are the values of the last write
        self._players: dict[tuple[str, str], tuple[Interface, BlockMaker, bytes]] = {}
        self._writes: Iterator[InterfaceWrite] = iter(writes)
        for uid, first_write in first_writes.items():
            self._open_writer(uid, first_write)
        self._next_write = next(self._writes, None)
        board.release = self._release_writer

    def _open_writer(self, uid: str, first_write: InterfaceWrite) -> None:
        interface_type, interface_id = key = parse_uid(uid)
        try:
            interface_class = self._board.registry.get(interface_type)
        except InterfaceDefinitionError:
            raise  # the user must mend a changed or broken definition, which the run would use, too
        except InterfaceError as error:
            # a warning, because the run lacks the data of an interface that only another program defines
            self._log.warn(f"{uid} is not replayed: {error.message}")
            return
        block_maker = BlockMaker(interface_class)
        block_maker.check_fields(first_write.values, uid)
        try:
            writer = self._board.open_for_writing(interface_type, interface_id, owner=OWNER)
        except CxbridgeError as error:
            # no warning, because the run itself usually writes the interface
            self._log.info(f"{uid} is not replayed: {error.message}")
            return
        self._players[key] = writer, block_maker, b""

    def loop(self) -> None:
        """Write the values that are due, and drop messages to the interfaces."""
        now_us = self._board.clock.now_us()
        # not with the time of this loop: such a write may have come after the rules of its loop, e.g. at the
        # hook ACT, and then only the next loop sees it
        while self._next_write is not None and self._next_write.time_us < now_us:
            self._write(self._next_write)
            self._next_write = next(self._writes, None)
        # the recording has no replies to these messages, whose queues would otherwise fill
        for writer, _, _ in self._players.values():
            writer.msgq_flush()

    def close(self) -> None:
        self._board.release = None
        for writer, _, _ in self._players.values():
            self._board.close(writer)
        self._players.clear()

    def _write(self, event: InterfaceWrite) -> None:
        key = parse_uid(event.uid)
        player = self._players.get(key)
        if player is None:
            return
        writer, block_maker, previous_data = player
        block = block_maker.make_block(event.values, event.time_us, event.uid)
        data = block[STAMP.size :]  # without the time stamp at the start
        writer.set_from_chunk(block)
        # listeners must see a change only if the values differ, not at each write
        if data != previous_data:
            self._players[key] = writer, block_maker, data
            writer.mark_data_changed()
        writer.write()

    def _release_writer(self, key: tuple[str, str]) -> None:
        """Release an interface to the run's writer."""
        if key in self._players:
            writer, _, _ = self._players.pop(key)
            self._log.debug(f"{'::'.join(key)} is no longer replayed: the run itself writes it")
            self._board.close(writer)
