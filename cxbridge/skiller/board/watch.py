"""The executors on the blackboard and their states, as far as the skill board has read them."""

from __future__ import annotations

from collections import deque
from glob import escape
from typing import TYPE_CHECKING, Any, NamedTuple
from uuid import UUID

from cxbridge.blackboard.errors import BlackBoardError
from cxbridge.blackboard.listeners import EventKind, Listener, Observer, listening
from cxbridge.skiller.board.protocol import EXECUTOR_TYPE, ExecutorState, enum_name

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.events import Logger
    from cxbridge.interfaces.instance import Interface


_STATES = {state.value: state for state in ExecutorState}


class ExecutorInfo(NamedTuple):
    """The published state of an executor.

    :param skill: the name of the running skill; empty if the executor is idle.
    """

    id: str
    agent: str
    skills: tuple[str, ...]
    state: ExecutorState
    skill: str


class ExecutorChange(NamedTuple):
    """A change of an executor.

    :param is_gone: whether the executor has ended, or the connection was lost; otherwise the executor has
        written its state.
    """

    executor: str
    is_gone: bool


class ExecutorWatch(Listener, Observer):
    """All executors on a blackboard.

    The blackboard reports events in any thread; :meth:`take_changes` handles them in the caller's thread.
    An executor sends its messages before it ends. Therefore, when its end is reported, all its messages to
    the skill board are in the board's queue.

    :param owner: the owner of the opened interfaces.
    """

    def __init__(self, board: BlackBoard, log: Logger, owner: str) -> None:
        self._board = board
        self._log = log
        self._owner = owner
        # an event ("there", "wrote" or "gone") and the id of its executor
        self._events: deque[tuple[str, str]] = deque()
        # the classes of the interfaces are made from XML at run time, so they have no static types
        self._instances: dict[str, Any] = {}
        self._executor_infos: dict[str, ExecutorInfo] = {}
        self._infos_by_agent: dict[str, dict[str, ExecutorInfo]] = {}  # of each agent, by executor
        self.version = 0
        """A number that changes with the executors or their states."""
        self.offered_skills: set[tuple[str, str]] = set()
        """Agents and skills of all present and former executors."""
        # the observer first, so that no new executor is missed; an executor reported twice is opened once
        board.register_observer(self, EXECUTOR_TYPE)
        for interface_info in board.list(EXECUTOR_TYPE):
            self._events.append(("there", interface_info.id))

    def all(self) -> list[ExecutorInfo]:
        """Return all executors in order of appearance."""
        return list(self._executor_infos.values())

    def get(self, executor: str) -> ExecutorInfo | None:
        """Return the state of an executor; None if the executor is unknown."""
        return self._executor_infos.get(executor)

    def instance(self, executor: str) -> Interface | None:
        """Return the instance that sends messages to an executor; None if the executor is unknown."""
        return self._instances.get(executor) if executor in self._executor_infos else None

    def agent_executors(self, agent: str) -> list[ExecutorInfo]:
        """Return the executors of an agent in order of appearance."""
        return list(self._infos_by_agent.get(agent, {}).values())

    def take_changes(self) -> list[ExecutorChange]:
        """Return the changes since the last call, in order."""
        changes: list[ExecutorChange] = []
        while self._events:
            event, executor = self._events.popleft()
            if event == "there":
                self._open(executor, changes)
            elif event == "gone":
                self._forget(executor, changes)
            elif (instance := self._instances.get(executor)) is not None:
                self._read(executor, instance, changes)
        return changes

    def close(self) -> None:
        """Stop watching."""
        self._board.unregister_observer(self)
        for instance in self._instances.values():
            instance.close()
        self._instances.clear()
        self._executor_infos.clear()
        self._infos_by_agent.clear()

    def _open(self, executor: str, changes: list[ExecutorChange]) -> None:
        if executor in self._instances:
            return
        try:
            instance = self._board.open_for_reading(
                EXECUTOR_TYPE,
                executor,
                owner=self._owner,
                listen=listening(self, EventKind.DATA_REFRESHED, EventKind.WRITER_REMOVED),
            )
        except BlackBoardError as error:
            self._log.warn(f"cannot read the state of the executor {executor}: {error.message}")
            return
        self._instances[executor] = instance
        self._read(executor, instance, changes)

    def _read(self, executor: str, instance: Any, changes: list[ExecutorChange]) -> None:
        if not instance.valid:  # the connection to the blackboard was lost
            self._forget(executor, changes)
            return
        instance.read()
        agent = instance.agent
        if not agent or not instance.has_writer:
            return  # the executor has published nothing yet, or has ended, which the next event reports
        state = _STATES.get(enum_name(instance.state))
        if state is None:
            self._log.warn(f"the executor {executor} is in an unknown state: {enum_name(instance.state)}")
            return
        former_executor_info = self._executor_infos.get(executor)
        executor_info = ExecutorInfo(executor, agent, tuple(instance.skills.split()), state, instance.skill)
        self.offered_skills.update((agent, skill) for skill in executor_info.skills)
        # another program may reuse the id of an executor
        if former_executor_info is not None and former_executor_info.agent != agent:
            del self._infos_by_agent[former_executor_info.agent][executor]
        self._executor_infos[executor] = executor_info
        self._infos_by_agent.setdefault(agent, {})[executor] = executor_info
        self.version += 1
        changes.append(ExecutorChange(executor, is_gone=False))

    def _forget(self, executor: str, changes: list[ExecutorChange]) -> None:
        """Handle the end of an executor. A successor may exist already."""
        instance = self._instances.pop(executor, None)
        executor_info = self._executor_infos.pop(executor, None)
        if executor_info is not None:
            del self._infos_by_agent[executor_info.agent][executor]
            self.version += 1
            changes.append(ExecutorChange(executor, is_gone=True))
        if instance is not None:
            instance.close()
            try:
                successors = self._board.list(EXECUTOR_TYPE, escape(executor))
            except BlackBoardError:
                return  # disconnected: after reconnection the blackboard reports all interfaces
            if successors:
                self._events.append(("there", executor))

    def interface_created(self, interface_type: str, interface_id: str) -> None:  # noqa: ARG002 - of Observer
        self._events.append(("there", interface_id))

    def data_refreshed(self, interface: Interface) -> None:
        self._events.append(("wrote", interface.id))

    def writer_removed(self, interface: Interface, serial: UUID) -> None:  # noqa: ARG002 - of Listener
        self._events.append(("gone", interface.id))
