"""A sender of one board, as seen by the writer on the other board."""

from __future__ import annotations

from contextlib import suppress
from uuid import UUID

from cxbridge.blackboard.exclusive_control import ACQUIRE, RELEASE, skip_stale_ids
from cxbridge.errors import BlackBoardError
from cxbridge.interfaces.instance import Interface
from cxbridge.interfaces.message import Message


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
