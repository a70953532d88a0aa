"""The skill board of a run or a daemon: masters, executors of this process, the Skillers of agents."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.executor import as_executor
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.local_calls import LocalSkillCalls
from cxbridge.skiller.board.skiller import BoardSkiller

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus
    from cxbridge.skiller.board.executor import Execution
    from cxbridge.skiller.board.policy import BoardPolicy
    from cxbridge.skiller.board.settings import BoardSettings

_ROUNDS = 20


class SkillBoardService:
    """Does all of it, a loop at a time; a command is carried out in the loop in which it is read.

    :param settings: of the configuration.
    :param policy: how the board treats executors.
    :param execution: how executors of this process execute calls.
    :raises CxbridgeError: when an executor cannot be made, or an interface has another writer.
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
        self._first = 0  # the Skiller that takes commands first
        self.skillers: list[BoardSkiller] = []
        self.hosts: list[ExecutorHost] = []
        self._execution = execution
        self.verbatim = policy is not None and policy.verbatim
        """Whether executors of this process send the yielded values as FEEDBACK, and nothing else."""
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
        """Take in an executor."""
        host.execution = self._execution
        self.hosts.append(host)
        host.meet(self.skills.name)
        self.skills.local.add(host.name)

    def remove(self, host: ExecutorHost, leave: Callable[[ExecutorHost], None] = ExecutorHost.close) -> None:
        """Let an executor go.

        :param leave: how: :meth:`ExecutorHost.close`, or :meth:`ExecutorHost.abandon`.
        """
        self.hosts.remove(host)
        leave(host)
        self.skills.local.discard(host.name)

    @property
    def running(self) -> bool:
        """Whether some action is not over."""
        return self.skills.running or any(skiller.running for skiller in self.skillers)

    def loop(self) -> None:
        """Take commands, find executors, execute a step of each, publish the result."""
        self._take()
        self.settle()
        for host in self.hosts:
            host.step()
        self.skills.loop()  # FEEDBACK, FINISH
        for skiller in self.skillers:
            skiller.publish()

    def _take(self) -> None:
        """Let Skillers take their commands, until the board is full; the rest is first in the next loop."""
        count = len(self.skillers)
        for number in range(count):
            if self.skills.is_full:
                self._first = (self._first + number) % count
                return
            self.skillers[(self._first + number) % count].take()

    def settle(self) -> None:
        """Exchange messages until every master has its executor; no skill advances."""
        for _ in range(_ROUNDS):
            active = self.skills.exchange()
            for host in self.hosts:
                active |= host.exchange()
            if not active:
                break

    def close(self) -> None:
        """End all skills, close all interfaces."""
        for skiller in self.skillers:
            skiller.close()
        for host in self.hosts:
            host.exchange()
            host.close()
        self.skills.close()
        self.skillers, self.hosts = [], []
