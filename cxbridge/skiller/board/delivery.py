"""Messages of a skill board to executors. Each remote executor has a thread, because a delivery may block."""

from __future__ import annotations

from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.skiller.board.protocol import EXECUTOR_TYPE, MAX_LABEL_BYTES, SkillCall, Ticket, truncate

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface, Message
    from cxbridge.skiller.board.watch import ExecutorWatch


class Sender:
    """Makes the messages of a board's masters and delivers them to executors.

    :param name: the board's name, a part of each ticket.
    :param epoch: the board's epoch, a part of each ticket.
    :param is_synchronous: deliver synchronously to all executors, as a virtual clock requires.
    """

    def __init__(
        self,
        board: BlackBoard,
        watch: ExecutorWatch,
        *,
        name: str,
        epoch: int,
        owner: str,
        is_synchronous: bool,
    ) -> None:
        self.local_executors: set[str] = set()
        """The names of executors in this process, which get their messages synchronously."""
        self._board, self._watch = board, watch
        self._name, self._epoch, self._owner = name, epoch, owner
        self._is_synchronous = is_synchronous
        # executor, message and error of each failed delivery
        self._failures: deque[tuple[str, Any, BlackBoardError]] = deque()
        # by executor: the interface that gets its messages, and the thread that delivers them
        self._remote_executors: dict[str, tuple[Interface, ThreadPoolExecutor]] = {}

    def request(self, executor: str, number: int, call: SkillCall, parameters: str) -> None:
        """Send REQUEST.

        :param number: the number of the master.
        :param parameters: the parameters of the call as JSON.
        """
        self._send(
            executor,
            "RequestMessage",
            self._ticket(number),
            call.agent,
            call.skill,
            parameters,
            truncate(call.label, MAX_LABEL_BYTES),
        )

    def confirm(self, executor: str, number: int) -> None:
        self._send(executor, "ConfirmMessage", self._ticket(number))

    def reject(self, executor: str, number: int, epoch: int | None = None) -> None:
        """Send REJECT.

        :param epoch: an earlier epoch of the board; None: the present epoch.
        """
        self._send(executor, "RejectMessage", self._ticket(number, epoch))

    def cancel(self, executor: str, number: int, epoch: int | None = None) -> None:
        """Send CANCEL.

        :param epoch: an earlier epoch of the board; None: the present epoch.
        """
        self._send(executor, "CancelMessage", self._ticket(number, epoch))

    def next_failure(self) -> tuple[str, Any, BlackBoardError] | None:
        """Return executor, message and error of the next failed delivery, or None."""
        return self._failures.popleft() if self._failures else None

    def forget(self, executor: str) -> None:
        """Drop the messages for a lost executor."""
        if executor in self._remote_executors:
            interface, thread = self._remote_executors.pop(executor)
            thread.shutdown(wait=False, cancel_futures=True)
            interface.close()

    def close(self) -> None:
        """Deliver pending messages, and release all resources."""
        for _, thread in self._remote_executors.values():
            thread.shutdown(wait=False)  # all at once, before the wait for any
        for interface, thread in self._remote_executors.values():
            thread.shutdown(wait=True)
            interface.close()
        self._remote_executors.clear()

    def _ticket(self, number: int, epoch: int | None = None) -> Ticket:
        return Ticket(self._name, self._epoch if epoch is None else epoch, number)

    def _send(self, executor: str, message_type: str, ticket: Ticket, *values: str) -> None:
        """Send a message.

        :param values: the fields after the ticket.
        """
        reader = self._watch.instance(executor)
        if reader is None:
            return  # the watch reports the end of the executor
        message: Message = reader.create_message(message_type, *ticket, *values)
        if self._is_synchronous or executor in self.local_executors:
            self._deliver(reader, message)
            return
        if executor not in self._remote_executors:
            try:
                # a separate instance, because this thread reads the first instance
                interface = self._board.open_for_reading(EXECUTOR_TYPE, executor, owner=self._owner)
            except BlackBoardError as error:
                self._failures.append((executor, message, error))
                return
            # a single thread for each executor keeps its messages in order
            self._remote_executors[executor] = interface, ThreadPoolExecutor(1, "skill-board")
        interface, thread = self._remote_executors[executor]
        thread.submit(self._deliver, interface, message)

    def _deliver(self, receiver: Interface, message: Message) -> None:
        try:
            receiver.msgq_enqueue(message)
        except BlackBoardError as error:
            self._failures.append((receiver.id, message, error))
