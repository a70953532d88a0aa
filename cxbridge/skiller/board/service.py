"""The skill board of a run or daemon: masters, local executors, and the Skillers of agents."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.executor import execute_itself
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.master import Master
from cxbridge.skiller.board.protocol import MasterState, SkillCall
from cxbridge.skiller.board.watch import ExecutorInfo
from cxbridge.skiller.interface import InterfaceSkiller
from cxbridge.skiller.skillstring import SkillStringCall, parse_skill_call, parse_skill_string
from cxbridge.skiller.status import Status

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus
    from cxbridge.skiller.board.executor import Execution
    from cxbridge.skiller.board.settings import BoardSettings

LOG_COMPONENT = "SkillBoardSkiller"


class BoardSkiller(InterfaceSkiller):
    """Executes skill strings with an agent's executors.

    :param name: the id of the SkillerInterface.
    :raises BlackBoardError: if the interface has another writer.
    """

    def __init__(
        self, board: BlackBoard, skill_board: SkillBoard, bus: EventBus, *, agent: str, name: str = "Skiller"
    ) -> None:
        super().__init__(board, bus, name=name, component=LOG_COMPONENT)
        self.agent = agent
        self._skill_board = skill_board
        self._masters: list[Master] = []

    @property
    def is_executing(self) -> bool:
        return bool(self._masters)

    def loop(self) -> None:
        """Handle messages and publish an outcome; the caller runs the loop of the skill board."""
        self.handle_messages()
        self.publish()

    def publish(self) -> None:
        """Write the outcome of the skill string after the first failure or the last success."""
        masters = self._masters
        failure = next(
            (master for master in masters if master.state in (MasterState.FAILED, MasterState.CANCELLED)),
            None,
        )
        if failure is not None:
            self.end(Status.S_FAILED, failure.error or f"{failure.call.skill} was cancelled")
        elif masters and all(master.is_over for master in masters):
            self.end(Status.S_FINAL)

    def start(self, skill_string: str) -> None:
        for call in parse_calls(skill_string, self.agent):
            self._masters.append(self._skill_board.request(call))

    def drop(self) -> None:
        """Cancel all masters."""
        masters, self._masters = self._masters, []
        for master in masters:
            self._skill_board.cancel(master)


class LocalSkillCalls:
    """The access of the executive's feature ``skill-board`` to the skill board in its process."""

    def __init__(self, skill_board: SkillBoard) -> None:
        self._skill_board = skill_board

    @property
    def version(self) -> int:
        """See :attr:`SkillBoard.version`."""
        return self._skill_board.version

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        """The present executors in order of appearance."""
        return self._skill_board.executors

    def request(
        self,
        skill: str,
        parameters: Mapping[str, Any],
        agent: str,
        on_change: Callable[[Master], None],
        label: str = "",
    ) -> Master:
        """Request a skill.

        :param label: the display name of the master.
        :raises SkillError: if names or parameters do not fit into messages.
        """
        return self._skill_board.request(SkillCall(skill, agent, parameters, label), on_change)

    def request_string(self, skill_string: str, agent: str, on_change: Callable[[Master], None]) -> Master:
        """Request a skill string with one call.

        :raises SkillError: if the skill string is invalid, or names or parameters do not fit into messages.
        """
        return self._skill_board.request(_to_skill_call(parse_skill_call(skill_string), agent), on_change)

    def cancel(self, number: int) -> bool:
        """Cancel an action; return False if it is unknown, over or being cancelled already."""
        master = self._skill_board.master(number)
        return master is not None and self._skill_board.cancel(master)


def parse_calls(skill_string: str, agent: str) -> list[SkillCall]:
    """Return the calls in a skill string.

    :raises SkillError: if the skill string is invalid.
    """
    return [_to_skill_call(call, agent) for call in parse_skill_string(skill_string)]


def _to_skill_call(call: SkillStringCall, agent: str) -> SkillCall:
    return SkillCall(call.name, agent, _convert_keys(call.args))


def _convert_keys(value: Any) -> Any:
    """Return an argument with text keys, as JSON requires."""
    if isinstance(value, dict):
        return {str(key): _convert_keys(item) for key, item in value.items()}
    return value


# messages cause answers, and an endless exchange must not block the loop; REQUEST, RESPONSE and CONFIRM take
# three rounds
_MAX_ROUNDS = 20


class SkillBoardService:
    """Masters, local executors and Skillers of a skill board, advanced together once per loop.

    A command is executed in the loop that reads the command.

    :param execution: executes the calls of local executors.
    :raises CxbridgeError: if an executor cannot be made or an interface has another writer.
    """

    def __init__(
        self,
        board: BlackBoard,
        clock: Clock,
        bus: EventBus,
        settings: BoardSettings,
        board_class: type[SkillBoard] = SkillBoard,
        execution: Execution = execute_itself,
    ) -> None:
        self.skill_board = board_class(board, clock, bus, name=settings.name, timeouts=settings.timeouts)
        self.local_calls = LocalSkillCalls(self.skill_board)
        self.skillers: list[BoardSkiller] = []
        self.hosts: list[ExecutorHost] = []
        self._execution = execution
        try:
            for agent in settings.agents:
                self.skillers.append(
                    BoardSkiller(board, self.skill_board, bus, agent=agent.name, name=agent.skiller)
                )
                for executor in agent.executors if settings.in_process else ():
                    self.add(
                        executor.make_host(agent.name, board, clock, bus, verbatim=board_class.is_verbatim)
                    )
        except Exception:
            self.close()
            raise

    def add(self, host: ExecutorHost) -> None:
        """Add an executor.

        :raises BlackBoardError: if the executor cannot open the interface of the skill board.
        """
        host.execution = self._execution
        self.hosts.append(host)
        host.open_board(self.skill_board.name)
        self.skill_board.local_executors.add(host.name)

    def remove(self, host: ExecutorHost, leave: Callable[[ExecutorHost], None] = ExecutorHost.close) -> None:
        """Remove an executor.

        :param leave: :meth:`ExecutorHost.close` or :meth:`ExecutorHost.abandon`.
        """
        self.hosts.remove(host)
        leave(host)
        self.skill_board.local_executors.discard(host.name)

    @property
    def running(self) -> bool:
        """Whether an action is running."""
        return self.skill_board.running or any(skiller.running for skiller in self.skillers)

    def loop(self) -> None:
        """Handle commands, find executors, execute a step of each, and publish the results."""
        for skiller in self.skillers:
            skiller.handle_messages()
        self.settle()
        for host in self.hosts:
            host.step()
        self.skill_board.loop()  # handles FEEDBACK and FINISH of this loop
        for skiller in self.skillers:
            skiller.publish()

    def settle(self) -> None:
        """Exchange messages without executing steps, until neither the board nor an executor has any.

        The next loop continues an exchange of too many rounds.
        """
        for _ in range(_MAX_ROUNDS):
            is_active = self.skill_board.exchange()
            for host in self.hosts:
                is_active |= host.exchange()
            if not is_active:
                break

    def close(self) -> None:
        """End all skills and close all interfaces."""
        for skiller in self.skillers:
            skiller.close()
        for host in self.hosts:
            host.exchange()
            host.close()
        self.skill_board.close()
        self.skillers, self.hosts = [], []
