"""The player of a replay: writes recorded values of interfaces to a blackboard.

The player opens all interfaces before the first write: an interface with another writer stops the replay
before anything has changed.
"""

from __future__ import annotations

from collections.abc import Iterable
from contextlib import suppress
from typing import Final

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.errors import WriterActiveError
from cxbridge.blackboard.names import parse_uid
from cxbridge.errors import BlackBoardError, CxbridgeError, TraceError
from cxbridge.events import InterfaceWrite
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.trace.replay.block_maker import BlockMaker
from cxbridge.trace.replay.pace import Pace
from cxbridge.trace.replay.replayed_writes import ReplayedWrite, ReplaySurvey

OWNER: Final = "cxbridge replay"
"""The owner of the opened interfaces."""


class ReplayPlayer:
    """Writes recorded interfaces, in the thread of the caller.

    :param board: the blackboard, not closed by the player.
    """

    def __init__(self, board: BlackBoard) -> None:
        self.write_counts: dict[str, int] = {}
        """The number of writes by ``Type::id``."""
        self._board = board
        # both by ``Type::id``
        self._writers_and_makers: dict[str, tuple[Interface, BlockMaker]] = {}
        self._last_data: dict[str, bytes] = {}  # the last written block without its time stamp

    def open(self, survey: ReplaySurvey) -> None:
        """Open all interfaces to write, or none.

        :raises TraceError: if the definition of a type differs from the recorded fields.
        :raises BlackBoardError: if an interface cannot be opened, e.g. because it has a writer.
        :raises InterfaceError: if a type is unknown, or its definition is invalid.
        """
        try:
            for uid, first_write in survey.first_writes.items():
                self._open_writer(uid, first_write)
        except CxbridgeError:
            self.close()
            raise

    def _open_writer(self, uid: str, first_write: InterfaceWrite) -> None:
        interface_type, interface_id = parse_uid(uid)
        try:
            maker = BlockMaker(self._board.registry.get(interface_type))
            # a trial of the first write finds a changed definition before the interface is opened
            maker.make_block(first_write.values, first_write.time_us, uid)
            maker.check_fields(first_write.values, uid)
            writer = self._board.open_for_writing(interface_type, interface_id, owner=OWNER)
        except WriterActiveError as error:
            owner = f", {error.owner}" if error.owner else ""
            raise BlackBoardError(
                f"{uid} cannot be replayed: it has a writer already{owner}",
                hint="replay only other interfaces (--interface), or stop its writer",
            ) from error
        writer.read()
        self._last_data[uid] = writer.to_bytes()[STAMP.size :]
        self._writers_and_makers[uid] = writer, maker

    def play(self, writes: Iterable[ReplayedWrite], pace: Pace) -> bool:
        """Replay the writes; return whether the end was reached.

        :raises BlackBoardError: if the blackboard was shut down.
        :raises TraceError: if a recorded value does not fit, or a written interface was not opened by
            :meth:`open`.
        """
        has_begun = False
        for write in writes:
            if not has_begun:
                has_begun = True
                pace.begin(write.position_us)
            if not pace.wait(write.position_us):
                return False
            self._write(write.event)
        return True

    def close(self) -> None:
        """Close the opened interfaces."""
        for writer, _ in self._writers_and_makers.values():
            with suppress(BlackBoardError):  # the blackboard may be gone already
                writer.close()
        self._writers_and_makers.clear()

    def _write(self, event: InterfaceWrite) -> None:
        writer_and_maker = self._writers_and_makers.get(event.uid)
        if writer_and_maker is None:
            raise TraceError(
                f"a write of {event.uid} appeared in the recording after the replay began",
                hint="replay the recording when it is complete",
            )
        writer, maker = writer_and_maker
        block = maker.make_block(event.values, event.time_us, event.uid)
        data = block[STAMP.size :]
        writer.msgq_flush()  # messages of other programs are not processed and would fill the queue
        writer.set_from_chunk(block)
        # readers learn whether a write changed anything besides its time stamp
        if data != self._last_data[event.uid]:
            self._last_data[event.uid] = data
            writer.mark_data_changed()
        writer.write()
        self.write_counts[event.uid] = self.write_counts.get(event.uid, 0) + 1
