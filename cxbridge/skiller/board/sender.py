"""A board's way to executors: REQUEST, CONFIRM, REJECT, CANCEL."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, Any

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.skiller.board.delivery import MessageDelivery
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import EXECUTOR_TYPE, LABEL_BYTES, Ticket, cut
from cxbridge.skiller.board.watch import ExecutorWatch

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface, Message


class Sender:
    """Makes messages and has them carried.

    :param epoch: of the board; with ``name`` the head of its tickets.
    :param at_once: send to everybody at once, and wait for it: as it must be on a virtual clock.
    """

    def __init__(
        self, board: BlackBoard, watch: ExecutorWatch, *, name: str, epoch: int, owner: str, at_once: bool
    ) -> None:
        self.local: set[str] = set()
        """Ids of executors in this process: their messages are sent at once."""
        self._board = board
        self._watch = watch
        self._name = name
        self._epoch = epoch
        self._owner = owner
        self._at_once = at_once
        self._failures: deque[tuple[str, Any, BlackBoardError]] = deque()
        self._delivery = MessageDelivery(lambda *failure: self._failures.append(failure))
        self._instances: dict[str, Interface] = {}

    def request(self, executor: str, master: Master) -> None:
        """Send REQUEST."""
        call = master.call
        self._send(
            executor,
            "RequestMessage",
            Ticket(self._name, self._epoch, master.number),
            call.agent,
            call.skill,
            master.parameters,
            cut(call.name, LABEL_BYTES),
        )

    def confirm(self, executor: str, number: int) -> None:
        """Send CONFIRM."""
        self._send(executor, "ConfirmMessage", Ticket(self._name, self._epoch, number))

    def reject(self, executor: str, number: int, epoch: int | None = None) -> None:
        """Send REJECT.

        :param epoch: of an earlier life of the board; None: this one.
        """
        self._send(executor, "RejectMessage", self._ticket(number, epoch))

    def cancel(self, executor: str, number: int, epoch: int | None = None) -> None:
        """Send CANCEL.

        :param epoch: of an earlier life of the board; None: this one.
        """
        self._send(executor, "CancelMessage", self._ticket(number, epoch))

    def failure(self) -> tuple[str, Any, BlackBoardError] | None:
        """Return a message that did not reach its executor, and why; None when there is none."""
        return self._failures.popleft() if self._failures else None

    def forget(self, executor: str) -> None:
        """Drop the messages for an executor that is gone."""
        instance = self._instances.pop(executor, None)
        if instance is not None:
            instance.close()

    def close(self) -> None:
        """Send what waits, and let go of everything."""
        self._delivery.close()
        for instance in self._instances.values():
            instance.close()
        self._instances.clear()

    def _ticket(self, number: int, epoch: int | None) -> Ticket:
        return Ticket(self._name, self._epoch if epoch is None else epoch, number)

    def _send(self, executor: str, message_type: str, ticket: Ticket, *values: str) -> None:
        """Send a message.

        :param values: its fields after the ticket's.
        """
        reader = self._watch.instance(executor)
        if reader is None:
            return  # it is gone, and another event says so
        message: Message = reader.create_message(message_type, *ticket, *values)
        if self._at_once or executor in self.local:
            self._delivery.send(reader, message)
            return
        try:
            instance = self._instances.get(executor)
            if instance is None:
                # a second instance: the first one is read in this thread
                instance = self._board.open_for_reading(EXECUTOR_TYPE, executor, owner=self._owner)
                self._instances[executor] = instance
        except BlackBoardError as error:
            self._failures.append((executor, message, error))
        else:
            self._delivery.post(instance, message)
