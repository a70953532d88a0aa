"""A skill board with scripted executors on a virtual clock."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from cxbridge.blackboard import BlackBoard, LocalBlackBoard
from cxbridge.clock import Clock, VirtualClock
from cxbridge.events import EventBus, LogLine
from cxbridge.interfaces import InterfaceRegistry
from cxbridge.skiller.board import (
    ExecutorContext,
    Progress,
    SkillCall,
    SkillExecutor,
    SkillFailedError,
    Steps,
)
from cxbridge.skiller.board.board import SkillBoard
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.skiller.board.master import Master

PERIOD_US = 33_333


class Puppet(SkillExecutor):
    """Executes until ``ends`` has an end: None for success, a text for failure."""

    skills = ("move", "grasp")

    def __init__(self, context: ExecutorContext) -> None:
        super().__init__(context)
        self.calls: list[SkillCall] = []
        self.cleaned = 0
        self.closed = False
        self.progress = 0.0
        self.ends: list[str | None] = []

    def execute(self, call: SkillCall) -> Steps:
        self.calls.append(call)
        try:
            while not self.ends:
                yield Progress(self.progress, f"{call.skill} on")
            end = self.ends.pop(0)
            if end is not None:
                raise SkillFailedError(end)
        finally:
            self.cleaned += 1

    def close(self) -> None:
        self.closed = True


class Rig:
    """A blackboard, skill boards and executors, which :meth:`loop` runs."""

    def __init__(self, board: BlackBoard | None = None, clock: Clock | None = None) -> None:
        self.clock = clock or VirtualClock()
        self.bus = EventBus(self.clock)
        self.lines: list[str] = []
        self.bus.subscribe(self._add_line, LogLine)
        self.board = board or LocalBlackBoard(InterfaceRegistry(), self.clock, self.bus)
        self.boards: list[SkillBoard] = []
        self.hosts: list[ExecutorHost] = []

    def _add_line(self, event: Any) -> None:
        self.lines.append(f"{event.level.value} {event.text}")

    def skills(
        self, name: str = "SkillBoard", board_class: type[SkillBoard] = SkillBoard, **options: Any
    ) -> SkillBoard:
        """Make a skill board."""
        skill_board = board_class(self.board, self.clock, self.bus, name=name, **options)
        self.boards.append(skill_board)
        return skill_board

    def puppet(self, agent: str, name: str, kind: type[Puppet] = Puppet) -> Puppet:
        """Add an executor to the blackboard."""
        context = ExecutorContext(agent, self.board, self.clock, self.bus.logger(name))
        executor = kind(context)
        self.hosts.append(ExecutorHost(executor, name))
        return executor

    def host(self, name: str) -> ExecutorHost:
        """Return an executor's host."""
        return next(host for host in self.hosts if host.name == name)

    def kill(self, name: str) -> None:
        """Remove an executor without its farewell."""
        host = self.host(name)
        self.hosts.remove(host)
        host.abandon()

    def loop(self, loops: int = 1) -> None:
        """Run loops of boards and executors."""
        for _ in range(loops):
            for board in self.boards:
                board.loop()
            for host in self.hosts:
                host.loop()
            for board in self.boards:
                board.loop()
            self.clock.sleep_until(self.clock.now_us() + PERIOD_US)

    def until(self, condition: Callable[[], bool], loops: int = 600) -> None:
        """Loop until the condition holds."""
        for _ in range(loops):
            if condition():
                return
            self.loop()
        raise AssertionError("the condition does not hold")

    def close(self) -> None:
        """Close executors, skill boards and the blackboard."""
        for host in self.hosts:
            host.close()
        for board in self.boards:
            board.close()
        self.board.shutdown()


def call(skill: str = "move", agent: str = "r1", **parameters: Any) -> SkillCall:
    """Return a skill call."""
    return SkillCall(skill, agent, parameters)


def states(*masters: Master) -> list[str]:
    """Return the states of masters."""
    return [str(master.state) for master in masters]
