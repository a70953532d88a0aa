"""The skill board of a run or daemon: masters, local executors, and the Skillers of agents."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.skiller.backend import SkillerBackend
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.executor import as_executor
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import MasterState, SkillCall
from cxbridge.skiller.board.watch import ExecutorInfo
from cxbridge.skiller.control import ExclusiveControl, ReaderWatch, sender_of
from cxbridge.skiller.failure import FailureCause, SkillFailure
from cxbridge.skiller.skillstring import parse_skill_string
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus
    from cxbridge.skiller.board.executor import Execution
    from cxbridge.skiller.board.policy import BoardPolicy
    from cxbridge.skiller.board.settings import BoardSettings

LOG_COMPONENT = "SkillBoardSkiller"
_NO_MESSAGE = 0


class BoardSkiller(SkillerBackend):
    """Executes skill strings with an agent's executors.

    It writes the same states as a Skiller in ``strict`` mode (docs/skiller.md).

    :param name: the id of the SkillerInterface.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(
        self, board: BlackBoard, skills: SkillBoard, bus: EventBus, *, agent: str, name: str = "Skiller"
    ) -> None:
        super().__init__(name)
        self.agent = agent
        self._log = bus.logger(LOG_COMPONENT)
        self._board = board
        self._skills = skills
        self._readers = ReaderWatch(board)
        # the class of the interface is made from XML at run time, so it has no static type
        self._interface: Any = board.open_for_writing(
            "SkillerInterface", name, owner=LOG_COMPONENT, listen=self._readers.listen
        )
        self._control = ExclusiveControl(self._interface, self._log)
        self._masters: list[Master] = []
        self._enqueued = False
        self._handlers = {
            "AcquireControlMessage": self._control.acquire,
            "ReleaseControlMessage": self._control.release,
            "ExecSkillMessage": self._exec,
            "StopExecMessage": self._stop,
        }

    @property
    def running(self) -> bool:
        """Whether a skill string is running or a message is pending."""
        return bool(self._masters) or not self._interface.msgq_empty()

    def loop(self) -> None:
        """Handle messages and publish changes. The caller does the board's loop."""
        self.take()
        self.publish()

    def take(self) -> None:
        """Handle the messages."""
        to_write = self._enqueued = False
        while (serial := self._readers.pop()) is not None:
            to_write |= self._control.revoke(serial)
        while (message := self._interface.msgq_pop()) is not None:
            handler = self._handlers.get(message.type)
            if handler is None:
                self._log.warn(f"Unhandled message of type {message.type} in skiller interface")
            else:
                to_write |= handler(message)
        if to_write:
            self._interface.write()

    def publish(self) -> None:
        """Write the progress of the skill string."""
        masters = self._masters
        if not masters:
            return
        bad = next((m for m in masters if m.state in (MasterState.FAILED, MasterState.CANCELLED)), None)
        if bad is not None:
            text = bad.error or f"{bad.call.skill} was cancelled"
            self._end_execution(SkillFailure(FailureCause.OUTCOME, text))
        elif all(master.is_over for master in masters):
            self._end_execution()

    def close(self) -> None:
        """Drop the skill string and close the interface."""
        self._drop()
        self._readers.close()
        self._board.close(self._interface)

    def _exec(self, message: Any) -> bool:
        text = message.skill_string
        if not self._control.admit(message, again=self._enqueued, running=bool(self._masters)):
            return False
        if self._masters:
            self._drop()
        self._enqueued = True
        self._interface.skill_string = text
        self._interface.msgid = message.id
        self._interface.error = ""
        self._interface.status = Status.S_RUNNING
        try:
            for call in calls_of(text, self.agent):
                self._masters.append(self._skills.request(call))
        except SkillError as error:
            self._drop()
            self._log.error(str(error))
            SkillFailure.of_string(error).show(self._interface)
        return True

    def _stop(self, message: Any) -> bool:
        if not self._control.may_execute(message):
            self._log.debug(f"{sender_of(message)} sent stop without any exclusive controller")
            return False
        self._log.debug(f"Stopping execution of '{self._interface.skill_string}' on request")
        self._drop()
        self._interface.skill_string = ""
        self._interface.msgid = _NO_MESSAGE
        self._interface.status = Status.S_INACTIVE
        return True

    def _end_execution(self, failure: SkillFailure | None = None) -> None:
        self._drop()
        self._interface.error = ""
        self._interface.status = Status.S_FINAL
        if failure is not None:
            failure.show(self._interface)
        self._interface.write()

    def _drop(self) -> None:
        """Cancel all masters."""
        masters, self._masters = self._masters, []
        for master in masters:
            self._skills.cancel(master)


class LocalSkillCalls:
    """The skill board for the executive's feature ``skill-board``."""

    def __init__(self, skills: SkillBoard) -> None:
        self._skills = skills
        self._open: dict[int, Master] = {}

    @property
    def version(self) -> int:
        """See :attr:`SkillBoard.version`."""
        return self._skills.version

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        """The present executors in order of appearance."""
        return self._skills.executors

    def ask(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[Master], None],
        name: str = "",
    ) -> Master:
        """Request a skill.

        :param name: the display name of the master.
        :raises SkillError: if names or parameters do not fit into messages.
        """
        return self._request_skill(SkillCall(skill, agent, parameters, name), on_change)

    def ask_for(self, skill_string: str, agent: str, on_change: Callable[[Master], None]) -> Master:
        """Request a skill string with one call.

        :raises SkillError: if the skill string is invalid, or names or parameters do not fit into messages.
        """
        calls = calls_of(skill_string, agent)
        if len(calls) != 1:
            raise SkillError(f"the skill string '{skill_string}' has {len(calls)} calls, expected one")
        return self._request_skill(calls[0], on_change)

    def stop(self, number: int) -> bool:
        """Cancel an action; return whether it was running."""
        master = self._open.get(number)
        return master is not None and self._skills.cancel(master)

    def _request_skill(self, call: SkillCall, on_change: Callable[[Master], None]) -> Master:
        def changed(master: Master) -> None:
            if master.is_over:
                self._open.pop(master.number, None)
            on_change(master)

        master = self._skills.request(call, changed)
        if not master.is_over:
            self._open[master.number] = master
        return master


def calls_of(text: str, agent: str) -> list[SkillCall]:
    """Return the calls in a skill string.

    :raises SkillError: if the skill string is invalid.
    """
    return [
        SkillCall(call.name, agent, {str(key): _with_names(value) for key, value in call.args.items()})
        for call in parse_skill_string(text)
    ]


def _with_names(value: Any) -> Any:
    """Return an argument with text keys, as JSON requires."""
    if isinstance(value, dict):
        return {str(key): _with_names(item) for key, item in value.items()}
    return value


_ROUNDS = 20  # answers cause further messages; an endless exchange must not block the cycle


class SkillBoardService:
    """Masters, local executors and Skillers of a skill board, advanced together once per loop.

    A command is executed in the loop that reads it.

    :param execution: executes the calls of local executors.
    :raises CxbridgeError: if an executor cannot be made or an interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        settings: BoardSettings,
        policy: BoardPolicy | None = None,
        execution: Execution = as_executor,
    ) -> None:
        self.skills = SkillBoard(
            board, clock, bus, name=settings.name, timeouts=settings.timeouts, policy=policy
        )
        self.local_calls = LocalSkillCalls(self.skills)
        self._first = 0  # index of the Skiller that reads commands first
        self.skillers: list[BoardSkiller] = []
        self.hosts: list[ExecutorHost] = []
        self._execution = execution
        self.verbatim = policy is not None and policy.verbatim
        """Whether local executors send exactly the yielded values as FEEDBACK."""
        try:
            for agent in settings.agents:
                self.skillers.append(
                    BoardSkiller(board, self.skills, bus, agent=agent.name, name=agent.skiller)
                )
                for make in agent.executors if settings.in_process else ():
                    self.add(make.host(agent.name, board, clock, bus, verbatim=self.verbatim))
        except Exception:
            self.close()
            raise

    def add(self, host: ExecutorHost) -> None:
        """Add an executor."""
        host.execution = self._execution
        self.hosts.append(host)
        host.meet(self.skills.name)
        self.skills.local.add(host.name)

    def remove(self, host: ExecutorHost, leave: Callable[[ExecutorHost], None] = ExecutorHost.close) -> None:
        """Remove an executor.

        :param leave: :meth:`ExecutorHost.close` or :meth:`ExecutorHost.abandon`.
        """
        self.hosts.remove(host)
        leave(host)
        self.skills.local.discard(host.name)

    @property
    def running(self) -> bool:
        """Whether an action is running."""
        return self.skills.running or any(skiller.running for skiller in self.skillers)

    def loop(self) -> None:
        """Handle commands, find executors, execute a step of each, and publish the results."""
        self._handle_commands()
        self.settle()
        for host in self.hosts:
            host.step()
        self.skills.loop()  # handles FEEDBACK and FINISH of this loop
        for skiller in self.skillers:
            skiller.publish()

    def _handle_commands(self) -> None:
        """Let Skillers handle commands until the board is full.

        The next loop continues with the next Skiller.
        """
        count = len(self.skillers)
        for number in range(count):
            if self.skills.is_full:
                self._first = (self._first + number) % count
                return
            self.skillers[(self._first + number) % count].take()

    def settle(self) -> None:
        """Exchange messages until each master has an executor, without executing steps."""
        for _ in range(_ROUNDS):
            active = self.skills.exchange()
            for host in self.hosts:
                active |= host.exchange()
            if not active:
                break

    def close(self) -> None:
        """End all skills and close all interfaces."""
        for skiller in self.skillers:
            skiller.close()
        for host in self.hosts:
            host.exchange()
            host.close()
        self.skills.close()
        self.skillers, self.hosts = [], []
