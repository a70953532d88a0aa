"""The executors on the blackboard and their states."""

from __future__ import annotations

from collections import deque
from glob import escape
from typing import TYPE_CHECKING, Any, NamedTuple
from uuid import UUID

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.listeners import EventKind, Listener, Observer, listening
from cxbridge.skiller.board.delivery import MessageDelivery
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import EXECUTOR_TYPE, LABEL_BYTES, ExecutorState, Ticket, cut, name_of

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.events import Logger
    from cxbridge.interfaces.instance import Interface, Message


class Sender:
    """Makes and delivers messages to executors.

    :param epoch: the board's epoch, in tickets.
    :param at_once: deliver synchronously to all executors, as a virtual clock requires.
    """

    def __init__(
        self, board: BlackBoard, watch: ExecutorWatch, *, name: str, epoch: int, owner: str, at_once: bool
    ) -> None:
        self.local: set[str] = set()
        """Executors in this process, which get their messages synchronously."""
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
        self._send(executor, "ConfirmMessage", Ticket(self._name, self._epoch, number))

    def reject(self, executor: str, number: int, epoch: int | None = None) -> None:
        """Send REJECT.

        :param epoch: an earlier epoch of the board; None: the present one.
        """
        self._send(executor, "RejectMessage", self._ticket(number, epoch))

    def cancel(self, executor: str, number: int, epoch: int | None = None) -> None:
        """Send CANCEL.

        :param epoch: an earlier epoch of the board; None: the present one.
        """
        self._send(executor, "CancelMessage", self._ticket(number, epoch))

    def failure(self) -> tuple[str, Any, BlackBoardError] | None:
        """Return an undelivered message with executor and reason, or None."""
        return self._failures.popleft() if self._failures else None

    def forget(self, executor: str) -> None:
        """Drop the messages for a lost executor."""
        instance = self._instances.pop(executor, None)
        if instance is not None:
            instance.close()

    def close(self) -> None:
        """Deliver pending messages and release all resources."""
        self._delivery.close()
        for instance in self._instances.values():
            instance.close()
        self._instances.clear()

    def _ticket(self, number: int, epoch: int | None) -> Ticket:
        return Ticket(self._name, self._epoch if epoch is None else epoch, number)

    def _send(self, executor: str, message_type: str, ticket: Ticket, *values: str) -> None:
        """Send a message.

        :param values: the fields after the ticket.
        """
        reader = self._watch.instance(executor)
        if reader is None:
            return  # reported by another event
        message: Message = reader.create_message(message_type, *ticket, *values)
        if self._at_once or executor in self.local:
            self._delivery.send(reader, message)
            return
        try:
            instance = self._instances.get(executor)
            if instance is None:
                # a separate instance, because the first one is read in this thread
                instance = self._board.open_for_reading(EXECUTOR_TYPE, executor, owner=self._owner)
                self._instances[executor] = instance
        except BlackBoardError as error:
            self._failures.append((executor, message, error))
        else:
            self._delivery.post(instance, message)


_STATES = {state.value: state for state in ExecutorState}


class ExecutorInfo(NamedTuple):
    """The published state of an executor.

    :param skill: the running skill; empty if idle.
    """

    id: str
    agent: str
    skills: tuple[str, ...]
    state: ExecutorState
    skill: str


class News(NamedTuple):
    """A change of an executor.

    :param gone: True for its end, False for a write.
    """

    executor: str
    gone: bool


class ExecutorWatch(Listener, Observer):
    """All executors on a blackboard.

    The blackboard reports events in any thread; :meth:`take` handles them in the caller's thread. When the
    end of an executor is reported, all its messages are in the receivers' queues.

    :param owner: the owner of the opened interfaces.
    """

    def __init__(self, board: BlackBoard, log: Logger, owner: str) -> None:
        self._board = board
        self._log = log
        self._owner = owner
        self._events: deque[tuple[str, str]] = deque()
        self._instances: dict[str, Any] = {}
        self._infos: dict[str, ExecutorInfo] = {}
        self._agents: dict[str, dict[str, ExecutorInfo]] = {}
        self.version = 0
        """A number that changes with the executors or their states."""
        self.offered: set[tuple[str, str]] = set()
        """Agents and skills of all present and former executors."""
        board.register_observer(self, EXECUTOR_TYPE)
        for info in board.list(EXECUTOR_TYPE):
            self._events.append(("there", info.id))

    def all(self) -> list[ExecutorInfo]:
        """Return all executors in order of appearance."""
        return list(self._infos.values())

    def get(self, executor: str) -> ExecutorInfo | None:
        """Return the state of an executor, or None."""
        return self._infos.get(executor)

    def instance(self, executor: str) -> Interface | None:
        """Return the reading instance of an executor, for sending messages, or None."""
        return self._instances.get(executor) if executor in self._infos else None

    def of_agent(self, agent: str) -> list[ExecutorInfo]:
        """Return the executors of an agent in order of appearance."""
        return list(self._agents.get(agent, {}).values())

    def take(self) -> list[News]:
        """Return the changes since the last call, in order."""
        news: list[News] = []
        while self._events:
            kind, executor = self._events.popleft()
            if kind == "there":
                self._open(executor, news)
            elif kind == "gone":
                self._forget(executor, news)
            elif (instance := self._instances.get(executor)) is not None:
                self._read(executor, instance, news)
        return news

    def close(self) -> None:
        """Stop watching."""
        self._board.unregister_observer(self)
        for instance in self._instances.values():
            instance.close()
        self._instances.clear()
        self._infos.clear()
        self._agents.clear()

    def _open(self, executor: str, news: list[News]) -> None:
        if executor in self._instances:
            return
        try:
            listen = listening(self, EventKind.DATA_REFRESHED, EventKind.WRITER_REMOVED)
            instance = self._board.open_for_reading(EXECUTOR_TYPE, executor, owner=self._owner, listen=listen)
        except BlackBoardError as error:
            self._log.warn(f"cannot look at the executor {executor}: {error.message}")
            return
        self._instances[executor] = instance
        self._read(executor, instance, news)

    def _read(self, executor: str, instance: Any, news: list[News]) -> None:
        if not instance.valid:
            self._forget(executor, news)
            return
        instance.read()
        agent = instance.agent
        if not agent or not instance.has_writer:
            return  # it has published nothing yet, or has ended and the next event reports that
        state = _STATES.get(name_of(instance.state))
        if state is None:
            self._log.warn(f"the executor {executor} is in an unknown state: {name_of(instance.state)}")
            return
        before = self._infos.get(executor)
        info = ExecutorInfo(executor, agent, tuple(instance.skills.split()), state, instance.skill)
        self.offered.update((agent, skill) for skill in info.skills)
        if before is not None and before.agent != agent:
            del self._agents[before.agent][executor]
        self._infos[executor] = info
        self._agents.setdefault(agent, {})[executor] = info
        self.version += 1
        news.append(News(executor, gone=False))

    def _forget(self, executor: str, news: list[News]) -> None:
        """Handle the end of an executor. A successor may exist already."""
        instance = self._instances.pop(executor, None)
        info = self._infos.pop(executor, None)
        if info is not None:
            del self._agents[info.agent][executor]
            self.version += 1
            news.append(News(executor, gone=True))
        if instance is not None:
            instance.close()
            try:
                successors = self._board.list(EXECUTOR_TYPE, escape(executor))
            except BlackBoardError:
                return  # disconnected: after reconnection the blackboard reports all interfaces
            if successors:
                self._events.append(("there", executor))

    def interface_created(self, interface_type: str, interface_id: str) -> None:  # noqa: ARG002
        self._events.append(("there", interface_id))

    def data_refreshed(self, interface: Interface) -> None:
        self._events.append(("wrote", interface.id))

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002
        self._events.append(("gone", interface.id))
