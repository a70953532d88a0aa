"""A sender on one board, as the writer on the other board sees it."""

from __future__ import annotations

from contextlib import suppress
from uuid import UUID

from cxbridge.blackboard.stale_ids import ACQUIRE, RELEASE, skip_stale_ids
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message


class SenderProxy:
    """Sends on for one sender: ids are counted for each apart, as everywhere on blackboards.

    The writer sees the sender's own serial as the source of the messages; but it does not see the sender
    leave, as it is on another board. So control that the sender acquired is given back for it.

    :param instance: a reading instance on the writer's board, closed with the proxy.
    :param source: serial of the sender.
    :param stand_in: the writer sees the instance's serial instead, and so that it leaves, however it ends.
    """

    def __init__(self, instance: Interface, source: UUID, *, stand_in: bool = False) -> None:
        self._instance = instance
        self._source = source
        self._stand_in = stand_in
        self._may_control = False

    @property
    def serial(self) -> UUID:
        """The serial of the instance."""
        return self._instance.serial

    def send(self, message: Message) -> int:
        """Send a copy of ``message``; return the id that it got, which is not one that the writer shows.

        :raises BlackBoardError: when it cannot be delivered.
        """
        twin = self._instance.create_message(message.type)
        twin.set_from_chunk(message.to_bytes())
        source = None if self._stand_in else self._source
        skip_stale_ids(self._instance, controls=self._may_control, source=source)
        if message.type in (ACQUIRE, RELEASE):
            self._may_control = message.type == ACQUIRE
        return self._send(twin)

    def _send(self, message: Message) -> int:
        if self._stand_in:
            return self._instance.msgq_enqueue(message)
        message.address(0, 0, self._instance.serial, self._source)
        return self._instance.msgq_enqueue(message, proxy=True)

    def close(self, controller: str) -> None:
        """Give control back, if the sender has it or may be about to get it, and leave.

        :param controller: serial of who has exclusive control, as far as is known here; empty: nobody.
        """
        with suppress(BlackBoardError):  # the board may be gone, and control with it
            if self._may_control and controller in ("", str(self._source)):
                self._send(self._instance.create_message(RELEASE))
            self._instance.close()
