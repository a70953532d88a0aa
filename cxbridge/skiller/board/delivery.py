"""Messages of a skill board to executors. Threads deliver to remote executors, which may block the sender."""

from __future__ import annotations

import threading
from collections import deque
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any, Final

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.skiller.board.protocol import EXECUTOR_TYPE, MAX_LABEL_BYTES, SkillCall, Ticket, truncate

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.interfaces.instance import Interface, Message
    from cxbridge.skiller.board.watch import ExecutorWatch

THREADS: Final = 8
"""The number of threads; while as many executors block, messages to further executors wait."""


class Sender:
    """Makes the messages of a board's masters and delivers them to executors.

    :param epoch: the board's epoch, in tickets.
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
        """Executors in this process, which get their messages synchronously."""
        self._board = board
        self._watch = watch
        self._name = name
        self._epoch = epoch
        self._owner = owner
        self._is_synchronous = is_synchronous
        self._failures: deque[tuple[str, Any, BlackBoardError]] = deque()
        self._instances: dict[str, Interface] = {}
        self._lock = threading.Lock()  # guards the three attributes below
        self._waiting_messages: dict[str, deque[tuple[Interface, Message]]] = {}
        self._pool: ThreadPoolExecutor | None = None
        self._is_closed = False

    def request(self, executor: str, number: int, call: SkillCall, parameters: str) -> None:
        """Send REQUEST.

        :param number: the number of the master.
        :param parameters: the parameters of the call as JSON.
        """
        label = truncate(call.label, MAX_LABEL_BYTES)
        self._send(
            executor, "RequestMessage", self._ticket(number), call.agent, call.skill, parameters, label
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
        """Return the next undelivered message with its executor and the reason, or None."""
        return self._failures.popleft() if self._failures else None

    def forget(self, executor: str) -> None:
        """Drop the messages for a lost executor."""
        instance = self._instances.pop(executor, None)
        if instance is not None:
            instance.close()

    def close(self) -> None:
        """Deliver pending messages, refuse further messages, and release all resources."""
        with self._lock:
            self._is_closed = True
            pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(wait=True)
        for instance in self._instances.values():
            instance.close()
        self._instances.clear()

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
        try:
            instance = self._instances.get(executor)
            if instance is None:
                # a separate instance, because this thread reads the first instance
                instance = self._board.open_for_reading(EXECUTOR_TYPE, executor, owner=self._owner)
                self._instances[executor] = instance
        except BlackBoardError as error:
            self._failures.append((executor, message, error))
        else:
            self._post(instance, message)

    def _deliver(self, receiver: Interface, message: Message) -> bool:
        """Deliver a message in this thread; return whether that succeeded."""
        try:
            receiver.msgq_enqueue(message)
        except BlackBoardError as error:
            self._failures.append((receiver.id, message, error))
            return False
        return True

    def _post(self, receiver: Interface, message: Message) -> None:
        """Deliver a message in another thread, after earlier messages to the same executor.

        :param receiver: an instance for exclusive use.
        """
        with self._lock:
            if self._is_closed:
                return
            queue = self._waiting_messages.get(receiver.id)
            if queue is not None:
                queue.append((receiver, message))
                return
            self._waiting_messages[receiver.id] = deque([(receiver, message)])
            if self._pool is None:
                self._pool = ThreadPoolExecutor(THREADS, thread_name_prefix="skill-board")
            # one job per executor at a time keeps its messages in order
            self._pool.submit(self._deliver_waiting, receiver.id)

    def _deliver_waiting(self, executor: str) -> None:
        """Deliver the waiting messages of an executor in a thread of the pool."""
        while True:
            with self._lock:
                queue = self._waiting_messages[executor]
                if not queue:
                    del self._waiting_messages[executor]
                    return
                receiver, message = queue.popleft()
            if not self._deliver(receiver, message) and self._is_closed:
                queue.clear()  # after closing, no thread retries for this executor
