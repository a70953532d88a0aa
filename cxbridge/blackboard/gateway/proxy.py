"""A sender on one board, as the writer on the other board sees it."""

from __future__ import annotations

from contextlib import suppress
from uuid import UUID

from cxbridge.blackboard.stale_ids import ACQUIRE, RELEASE, skip_stale_ids
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message


class SenderProxy:
    """Sends on for one sender: ids are counted for each sender apart, as everywhere on blackboards.

    The writer sees an instance of the gateway as the source of the messages. So the writer notices when that
    instance is closed, by the gateway or because the connection is lost, and takes control away from it.

    :param instance: a reading instance on the writer's board, closed with the proxy.
    """

    def __init__(self, instance: Interface) -> None:
        self._instance = instance
        self.may_control = False
        """Whether the sender may have exclusive control: it has asked for it, and has not released it."""

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
        skip_stale_ids(self._instance, controls=self.may_control)
        if message.type in (ACQUIRE, RELEASE):
            self.may_control = message.type == ACQUIRE
        return self._instance.msgq_enqueue(twin)

    def close(self, controller: str) -> None:
        """Give control back, if the sender has it or may be about to get it, and close the instance.

        :param controller: serial of the exclusive controller, as far as is known here; empty: there is none.
        """
        with suppress(BlackBoardError):  # the writer may be gone, and control with it
            if self.may_control and controller in ("", str(self.serial)):
                self._instance.msgq_enqueue(self._instance.create_message(RELEASE))
        with suppress(BlackBoardError):
            self._instance.close()
