"""The player of a replay: writes recorded values of interfaces to a blackboard, and sends recorded messages.

The player opens all interfaces before the first write: an interface with another writer stops the replay
before anything has changed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Final

from cxbridge.blackboard import BlackBoard
from cxbridge.blackboard.errors import WriterActiveError
from cxbridge.blackboard.names import parse_uid
from cxbridge.errors import BlackBoardError, CxbridgeError, InterfaceError, TraceError
from cxbridge.events import InterfaceMessage, InterfaceWrite, Logger
from cxbridge.interfaces.instance import STAMP, Interface
from cxbridge.trace.replay.blocks import BlockMaker, make_message
from cxbridge.trace.replay.moves import ReplayMove, ReplaySurvey
from cxbridge.trace.replay.pace import Pace

OWNER: Final = "cxbridge replay"
"""The owner of the opened interfaces."""


class ReplayPlayer:
    """Writes recorded interfaces, in the thread of the caller.

    :param board: the blackboard, not closed by the player.
    :param restamp: whether writes get the present time instead of the recorded one.
    """

    def __init__(self, board: BlackBoard, log: Logger, *, restamp: bool = False) -> None:
        self.write_counts: dict[str, int] = {}
        """The number of writes by ``Type::id``."""
        self.sent_count = 0
        """The number of sent messages."""
        self.undelivered_count = 0
        """The number of messages that were not delivered."""
        self._board = board
        self._log = log
        self._restamp = restamp
        # by ``Type::id``
        self._writers: dict[str, tuple[Interface, BlockMaker]] = {}
        self._readers: dict[str, Interface | None] = {}  # None: the interface cannot be opened
        self._last_data: dict[str, bytes] = {}  # the last written block without its time stamp
        self._reported_uids: set[str] = set()

    def open(self, survey: ReplaySurvey) -> None:
        """Open all interfaces to write, or none.

        :raises TraceError: if the definition of a type differs from the recorded fields.
        :raises BlackBoardError: if an interface has a writer, or its type is unknown.
        """
        try:
            for uid, sample in survey.samples.items():
                self._open_writer(uid, sample)
        except CxbridgeError:
            self.close()
            raise

    def _open_writer(self, uid: str, sample: InterfaceWrite) -> None:
        interface_type, interface_id = parse_uid(uid)
        try:
            maker = BlockMaker(self._board.registry.get(interface_type))
            # a trial of the first write finds a changed definition before any interface is opened
            maker.make_block(sample.values, sample.time_us, uid)
            maker.check_fields(sample.values, uid)
            writer = self._board.open_for_writing(interface_type, interface_id, owner=OWNER)
        except WriterActiveError as error:
            owner = f", {error.owner}" if error.owner else ""
            raise BlackBoardError(
                f"{uid} cannot be replayed: it has a writer already{owner}",
                hint="replay only other interfaces (--interface), or stop its writer",
            ) from error
        writer.read()
        self._last_data[uid] = writer.to_bytes()[STAMP.size :]
        self._writers[uid] = writer, maker

    def play(
        self,
        moves: Iterable[ReplayMove],
        pace: Pace,
        announce: Callable[[ReplayMove], None] = lambda _move: None,
    ) -> bool:
        """Replay all events; return whether the end was reached.

        :param announce: called for each event before the wait for it.
        :raises BlackBoardError: if the blackboard was shut down.
        :raises TraceError: if a recorded value does not fit.
        """
        has_begun = False
        for move in moves:
            if not has_begun:
                has_begun = True
                pace.begin(move.at_us)
            announce(move)
            if not pace.wait(move.at_us):
                return False
            if isinstance(move.event, InterfaceWrite):
                self._write(move.event)
            else:
                self._send(move.event)
        return True

    def close(self) -> None:
        """Close the opened interfaces."""
        readers = [reader for reader in self._readers.values() if reader is not None]
        for instance in (*readers, *(writer for writer, _ in self._writers.values())):
            with suppress(BlackBoardError):  # the blackboard may be gone already
                instance.close()
        self._writers.clear()
        self._readers.clear()

    def drop_messages(self) -> None:
        """Drop messages of other programs to the interfaces."""
        for writer, _ in self._writers.values():
            if writer.valid:
                writer.msgq_flush()

    def _write(self, event: InterfaceWrite) -> None:
        writer_and_maker = self._writers.get(event.uid)
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
        if self._restamp:
            writer.mark_data_refreshed()
        writer.write()
        self.write_counts[event.uid] = self.write_counts.get(event.uid, 0) + 1

    def _send(self, event: InterfaceMessage) -> None:
        try:
            reader = self._find_reader(event.uid)
            if reader is not None:
                reader.msgq_enqueue(make_message(reader, event.message, event.values))
                self.sent_count += 1
                return
        except (BlackBoardError, InterfaceError) as error:
            if not self._board.connected:
                raise
            self._report_once(event.uid, error)
        self.undelivered_count += 1

    def _find_reader(self, uid: str) -> Interface | None:
        """Return the reading instance that sends messages to an interface, or None if it cannot be opened."""
        if uid not in self._readers:
            self._readers[uid] = None  # remains after an error, which the next messages do not repeat
            self._readers[uid] = self._board.open_for_reading(*parse_uid(uid), owner=OWNER)
        return self._readers[uid]

    def _report_once(self, uid: str, error: CxbridgeError) -> None:
        if uid not in self._reported_uids:
            self._reported_uids.add(uid)
            self._log.warn(f"messages to {uid} cannot be sent: {error.message}")
