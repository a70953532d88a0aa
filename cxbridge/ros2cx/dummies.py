"""A skill board on which each action has somebody who executes it: a dummy where there is nobody else."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from cxbridge.ros2cx.executors import dummy_for
from cxbridge.skiller.board.executor import ExecutorContext
from cxbridge.skiller.board.host import make_host

if TYPE_CHECKING:
    from cxbridge.blackboard.base import BlackBoard
    from cxbridge.clock import Clock
    from cxbridge.events import EventBus
    from cxbridge.skiller.board.master import Master
    from cxbridge.skiller.board.station import SkillStation
    from cxbridge.skiller.board.watch import ExecutorInfo


class DummySkills:
    """The skill board of a station; an action that no executor of its agent knows gets a dummy.

    :param station: the skill board, and where executors of this process live.
    """

    def __init__(self, station: SkillStation, board: BlackBoard, clock: Clock, bus: EventBus) -> None:
        self._station = station
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
            log = self._bus.logger(name)
            log.warn(f"No executor of {agent} knows {skill}: a dummy pretends to execute it")
            context = ExecutorContext(agent, self._board, self._clock, log)
            self._station.add(make_host(dummy_for(skill), context, name))
        return self._station.desk.ask(skill, parameters, agent, on_change)

    def ask_for(self, skill_string: str, agent: str, on_change: Callable[[Master], None]) -> Master:
        """See :class:`~cxbridge.skiller.board.desk.SkillDesk`."""
        return self._station.desk.ask_for(skill_string, agent, on_change)

    def stop(self, number: int) -> bool:
        """Cancel an action; return whether there was something to cancel."""
        return self._station.desk.stop(number)
