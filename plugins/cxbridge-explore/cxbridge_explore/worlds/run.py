"""A run in a chosen world: a chooser decides at choice points."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING

from cxbridge.blackboard import parse_uid
from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.mainloop import Hook
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import NOTHING, Additions
from cxbridge.run.run import make_run
from cxbridge.run.source import source_of
from cxbridge.run.team import AgentWatcher, Team
from cxbridge_explore.worldmodel.known import check_world
from cxbridge_explore.worldmodel.model import WorldModel
from cxbridge_explore.worldmodel.reading import find_world, read_world
from cxbridge_explore.worlds.asking import Asking
from cxbridge_explore.worlds.points import Choice, Chooser, NotedChooser
from cxbridge_explore.worlds.sensing import OWNER, MessageChoices, SensedChoices
from cxbridge_explore.worlds.skills import SkillAnswer, SkillChoices
from cxbridge_explore.worlds.vanishing import AbsenceChoices, KillChoices, OrderChoices

if TYPE_CHECKING:
    from cxbridge.run.agent import Run


@dataclass(frozen=True, slots=True)
class WorldResult:
    """The end of a run in a chosen world.

    :param is_over: whether the run ended by itself.
    :param seconds: the duration by the run's clock.
    :param choices: all choices, in order.
    """

    is_over: bool
    seconds: float
    choices: tuple[Choice, ...]


# Makes the program to run, with the world's additions.
MakeAssembly = Callable[[RunOptions, Additions], "Run | Team"]


def make_scenario(options: RunOptions, additions: Additions) -> Run | Team:
    return make_run(options, additions=additions)


def world_beside(options: RunOptions) -> WorldModel:
    """Return the world in the scenario's folder; without one, each skill call may fail."""
    file = find_world(source_of(options).config_file().parent)
    return WorldModel() if file is None else read_world(file)


class WorldRun(Closing):
    """A run in a chosen world. A context manager. No thread is alive while the chooser is asked.

    :param options: the options of ``cxbridge run``, without their executors of skills.
    :param chooser: decides at each choice point.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make: makes the program to run.
    :raises CxbridgeError: if the scenario or the world is invalid.
    """

    def __init__(
        self,
        options: RunOptions,
        chooser: Chooser,
        world: WorldModel | None = None,
        *,
        make: MakeAssembly = make_scenario,
    ) -> None:
        self.options = options
        self._is_started = False
        self._asked = NotedChooser(chooser)
        self._world = world_beside(options) if world is None else world
        with ExitStack() as stack:
            self.assembly = make(options, self._additions())
            stack.enter_context(self.assembly)
            self._ask = Asking(self._asked, self.assembly.clock)
            check_world(self._world, self.assembly)
            self._parts = {agent.name: self._part(agent) for agent in self.assembly.agents}
            stack.callback(self._close_parts)
            self._kills, self._order = self._team_choices(self.assembly)
            self.assembly.loop.add(Hook.POST_LOOP, self._apply_events)
            self._stack = stack.pop_all()

    def _additions(self) -> Additions:
        planner = self._world.planner
        if planner is None:
            return NOTHING
        from cxbridge_explore.worlds.planning import ChosenPlanning  # noqa: PLC0415 - only agents that plan pay

        return Additions(planning=partial(ChosenPlanning, planner, lambda: self._ask))

    def _part(self, agent: Run) -> AgentWorld:
        prefix = f"{agent.name}/" if isinstance(self.assembly, Team) else ""
        return AgentWorld(self._world, agent, self._ask, prefix)

    def _team_choices(self, team: Run | Team) -> tuple[list[KillChoices], OrderChoices | None]:
        if not isinstance(team, Team):
            return [], None
        team.watchers.append(self)
        kills = [KillChoices(each, team, self._ask) for each in self._world.kills]
        order = None if self._world.order is None else OrderChoices(self._world.order, team, self._ask)
        return kills, order

    @property
    def watchers(self) -> list[AgentWatcher]:
        """The watchers of a team's agents. A single agent is never killed."""
        return self.assembly.watchers if isinstance(self.assembly, Team) else []

    def left(self, agent: Run) -> None:
        """Close the world of a killed agent."""
        self._parts.pop(agent.name).close()

    def joined(self, agent: Run) -> None:
        self._parts[agent.name] = self._part(agent)

    def _apply_events(self) -> None:
        """Apply the events between two loops."""
        for part in self._parts.values():
            part.loop()
        for kill in self._kills:
            kill.loop()
        if self._order is not None:
            self._order.loop()

    @property
    def seconds(self) -> float:
        """The seconds since the start of the run, by its clock."""
        return self._ask.seconds

    def state(self) -> tuple[Hashable, ...] | None:
        """Return the state on which the Skillers' next events depend, besides interfaces; times from now.

        None means unknown: executors of a skill board have hidden progress, and a configured world has more
        pending events than those of Skillers.
        """
        agents = self.assembly.agents
        if self._world != WorldModel() or any(agent.skill_board is not None for agent in agents):
            return None
        now_us = self.assembly.clock.now_us()
        return tuple(part.state(now_us) for part in self._parts.values())

    @property
    def answers(self) -> list[SkillAnswer]:
        """The results of skill calls of the living agents, agent by agent."""
        return [answer for part in self._parts.values() for answer in part.answers]

    @property
    def is_over(self) -> bool:
        """Whether root goals are finished, no skill runs, the agenda is empty and no agent will restart."""
        is_busy = any(part.running for part in self._parts.values())
        return self.assembly.is_over and not is_busy and not self.is_expecting

    @property
    def is_expecting(self) -> bool:
        """Whether a killed agent will restart."""
        return any(kill.is_expecting for kill in self._kills)

    def start(self) -> None:
        """Load the agents once, without choices."""
        if not self._is_started:
            self._is_started = True
            with self.assembly.loop.busy():
                self.assembly.start()

    def play(self, look: Callable[[], bool] = lambda: False) -> WorldResult:
        """Run to the end, or until ``look`` returns True after a loop."""
        assembly = self.assembly
        self.start()
        for part in self._parts.values():
            part.loop()
        end_us = assembly.clock.now_us() + round((self.options.timeout - self.seconds) * MICROSECONDS)

        def done() -> bool:
            return self.is_over or look() or assembly.clock.now_us() >= end_us

        assembly.loop.run(done)
        return WorldResult(self.is_over, self.seconds, tuple(self._asked.choices))

    def _close_parts(self) -> None:
        for part in self._parts.values():
            part.close()

    def close(self) -> None:
        """End the run and release all resources."""
        self._stack.close()


class AgentWorld(Closing):
    """The world of one agent.

    :param agent: an agent that is not started yet.
    :param prefix: the prefix of the subjects of its choices.
    """

    def __init__(self, world: WorldModel, agent: Run, ask: Asking, prefix: str) -> None:
        self._agent = agent
        with ExitStack() as stack:
            choices = SkillChoices(agent, world, ask, prefix, self._note)
            self._skills = choices.script
            self.answers = choices.answers
            stack.callback(self._skills.close)
            agent.loop.add(Hook.SKILL, self._skills.loop)
            stack.callback(agent.loop.remove, Hook.SKILL, self._skills.loop)
            writers = {
                uid: stack.enter_context(agent.board.open_for_writing(*parse_uid(uid), owner=OWNER))
                for uid in dict.fromkeys(each.uid for each in world.sensed)
            }
            self._absences = [
                AbsenceChoices(each, agent, self._skills, ask, prefix) for each in world.absences
            ]
            sensed = [SensedChoices(each, agent, writers[each.uid], ask, prefix) for each in world.sensed]
            messages = [
                stack.enter_context(MessageChoices(each, agent.board, ask, prefix)) for each in world.messages
            ]
            self._steps: tuple[Callable[[], None], ...] = (
                *(each.loop for each in messages),
                *(each.loop for each in sensed),
                *(each.loop for each in self._absences),
            )
            self._stack = stack.pop_all()

    def _note(self, name: str) -> None:
        for absence in self._absences:
            absence.note(name)

    def state(self, now_us: int) -> tuple[Hashable, ...]:
        """Return the state on which the Skillers' next events depend, besides interfaces; times from now."""
        return self._skills.state(now_us)

    @property
    def running(self) -> bool:
        return self._skills.running

    def loop(self) -> None:
        """Apply the events between two loops."""
        for step in self._steps:
            step()

    def close(self) -> None:
        self._stack.close()
