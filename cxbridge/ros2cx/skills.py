"""A skill board on which each action has somebody who executes it: a dummy where there is nobody else."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cxbridge.errors import SkillError
from cxbridge.ros2cx.executors import DummyExecutor
from cxbridge.ros2cx.skill_execution import NO_AGENT
from cxbridge.skiller.board.executor import ExecutorContext, SkillExecutor
from cxbridge.skiller.board.host import make_host
from cxbridge.skiller.board.loading import load_executor

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus
    from cxbridge.skiller.board.master import Master
    from cxbridge.skiller.board.station import SkillStation
    from cxbridge.skiller.board.watch import ExecutorInfo


class Ros2CxSkills:
    """The skill board of a station; an action that no executor of its agent knows gets a dummy.

    :param station: the skill board, and where executors of this process live.
    :param senses: whether what dummies bring about is sensed.
    """

    def __init__(
        self, station: SkillStation, board: BlackBoard, clock: Clock, bus: EventBus, *, senses: bool = True
    ) -> None:
        self._station = station
        self._senses = senses
        self._dummies: set[str] = set()
        self._board, self._clock, self._bus = board, clock, bus

    @property
    def version(self) -> int:
        """See :class:`~cxbridge.skiller.board.desk.SkillDesk`."""
        return self._station.desk.version

    @property
    def executors(self) -> Iterable[ExecutorInfo]:
        """The executors that there are."""
        return self._station.desk.executors

    def ask(
        self, skill: str, parameters: Mapping[str, Any], agent: str, on_change: Callable[[Master], None]
    ) -> Master:
        """Have a skill executed, by a dummy if need be.

        :raises SkillError: when names or parameters do not fit into messages.
        """
        if not any(info.agent == agent and skill in info.skills for info in self.executors):
            name = f"{agent}-{skill}-dummy"
            self._bus.logger(name).warn(
                f"No executor of {agent} knows {skill}: a dummy pretends to execute it"
            )
            self._add(for_skill(DummyExecutor, skill), agent, name)
            self._dummies.add(name)
        return self._station.desk.ask(skill, parameters, agent, on_change)

    def ask_for(self, skill_string: str, agent: str, on_change: Callable[[Master], None]) -> Master:
        """See :class:`~cxbridge.skiller.board.desk.SkillDesk`."""
        return self._station.desk.ask_for(skill_string, agent, on_change)

    def stop(self, number: int) -> bool:
        """Cancel an action; return whether there was something to cancel."""
        return self._station.desk.stop(number)

    def pretends(self, executor: str) -> bool:
        """Return whether an executor is a dummy whose effects nobody else senses."""
        return self._senses and executor in self._dummies

    def add_executor(self, text: str) -> None:
        """Make an executor for the agent without a name.

        :param text: ``ACTION=MODULE:CLASS`` or ``ACTION=FILE.py:CLASS``, from the current folder.
        :raises SkillError: when it is of another form, or there is no such class.
        """
        action, equals, target = text.partition("=")
        if not action or not equals:
            raise SkillError(f"--executor cannot be '{text}'", hint="write ACTION=FILE.py:CLASS")
        kind = load_executor(target, Path.cwd())
        number = sum(info.agent == NO_AGENT and action in info.skills for info in self.executors)
        self._add(for_skill(kind, action), NO_AGENT, f"{action}-{kind.__name__}-{number + 1}")

    def _add(self, kind: type[SkillExecutor], agent: str, name: str) -> None:
        context = ExecutorContext(agent, self._board, self._clock, self._bus.logger(name))
        self._station.add(make_host(kind, context, name))


def for_skill(kind: type[SkillExecutor], skill: str) -> type[SkillExecutor]:
    """Return a class of executors that executes just this skill."""
    return type(kind.__name__, (kind,), {"skills": (skill,)})
