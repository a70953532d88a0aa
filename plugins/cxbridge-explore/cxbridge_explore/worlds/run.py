"""A run in a chosen world: a chooser decides how skills end, and which further events happen.

Events are applied between two loops of the run. Only the results of skills, the fate of messages and the
faults of planners are decided within a loop, when an agent calls a skill, sends a message or requests a plan.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Final

from cxbridge.blackboard import parse_uid
from cxbridge.clock import MICROSECONDS
from cxbridge.closing import Closing
from cxbridge.mainloop import Hook
from cxbridge.run.mistakes import AgentChecks
from cxbridge.run.options import RunOptions
from cxbridge.run.program.additions import Additions
from cxbridge.run.result import COMPLETED, UNSUCCESSFUL, RunResult
from cxbridge.run.run import make_run, sum_up_run
from cxbridge.run.source import source_of
from cxbridge.run.stuck import StuckWatch
from cxbridge.run.team import AgentWatcher, Team
from cxbridge.run.watchdog import make_spin_watchdog
from cxbridge_explore.worldmodel.model import PlannerModel, WorldModel
from cxbridge_explore.worldmodel.names import check_world_of_run
from cxbridge_explore.worldmodel.reading import find_world, read_world
from cxbridge_explore.worlds.points import (
    Choice,
    ChoiceKind,
    Chooser,
    RunChoices,
    make_fault,
    make_options,
)
from cxbridge_explore.worlds.sensing import OWNER, MessageChoices, SensedChoices
from cxbridge_explore.worlds.skills import SkillChoices, SkillResult
from cxbridge_explore.worlds.vanishing import AbsenceChoices, KillChoices

if TYPE_CHECKING:
    from cxbridge.run.agent import Run

# The name of the addition with which the planners of the run ask for their faults.
PLANNER_FAULTS: Final = "planning.faults"


@dataclass(frozen=True, slots=True)
class WorldResult:
    """The end of a run in a chosen world.

    :param verdict: the result as of ``cxbridge run``; real time is not measured.
    :param choices: all choices, in order.
    """

    verdict: RunResult
    choices: tuple[Choice, ...]

    @property
    def is_over(self) -> bool:
        """Whether the run ended by itself."""
        return self.verdict.status in (COMPLETED, UNSUCCESSFUL)


# Makes the program to run, with the world's additions.
MakeAssembly = Callable[[RunOptions, Additions], "Run | Team"]


def make_scenario(options: RunOptions, additions: Additions) -> Run | Team:
    """Make the run of a scenario."""
    return make_run(options, additions=additions)


def read_scenario_world(options: RunOptions) -> WorldModel:
    """Read the world in the scenario's folder. Without a world, each skill call may fail."""
    file = find_world(source_of(options).config_file().parent)
    return WorldModel() if file is None else read_world(file)


class WorldRun(Closing):
    """A run in a chosen world, which is played once. A context manager.

    No thread except a watchdog is alive while the chooser decides, so that the chooser may fork the process.

    :param options: the options of ``cxbridge run``; the world replaces the executors of skills.
    :param chooser: decides at each choice point.
    :param world: the possible events; None for the file in the scenario's folder.
    :param make_assembly: makes the program to run.
    :ivar assembly: the agent or team that plays the run.
    :ivar choices: the choices so far, and the chooser.
    :raises CxbridgeError: if the scenario or the world is invalid.
    """

    def __init__(
        self,
        options: RunOptions,
        chooser: Chooser,
        world: WorldModel | None = None,
        *,
        make_assembly: MakeAssembly = make_scenario,
    ) -> None:
        self.options = options
        self._is_started = False
        self._loss_reason = ""
        self._world_model = read_scenario_world(options) if world is None else world
        self._kill_choices: list[KillChoices] = []
        with ExitStack() as stack:
            self.assembly = make_assembly(options, self._make_additions())
            stack.enter_context(self.assembly)
            self.choices = RunChoices(chooser, self.assembly.clock)
            check_world_of_run(self._world_model, self.assembly)
            self._agent_worlds: dict[str, AgentWorld] = {}
            stack.callback(self._close_agent_worlds)
            for agent in self.assembly.agents:
                self.joined(agent)
            if isinstance(self.assembly, Team):
                self.assembly.watchers.append(self)
                self._kill_choices = [
                    KillChoices(kill, self.assembly, self.choices) for kill in self._world_model.kills
                ]
            self._checks, self._stuck_watch = AgentChecks(self.assembly.agents), StuckWatch(self.assembly)
            self.watchers.append(self._checks)
            self.assembly.loop.add(Hook.POST_LOOP, self._apply_events)
            watchdog = make_spin_watchdog(self.assembly)
            watchdog.start()
            stack.callback(watchdog.stop)
            self._stack = stack.pop_all()

    def _make_additions(self) -> Additions:
        planner = self._world_model.planner
        values = {} if planner is None else {PLANNER_FAULTS: partial(self._choose_planner_fault, planner)}
        return Additions(values=values)

    def _choose_planner_fault(self, planner: PlannerModel, env: str, problem: str) -> tuple[str, float]:
        """Choose the fault of a planner call.

        :returns: the status of a call that gets no plan (empty: the call gets its plan), and the seconds by
            which the plan is late.
        """
        # the name and the probability of each option, then the status and the delay that the planner gets
        faults = (
            ("no plan", planner.no_plan_probability, "NO-PLAN", 0.0),
            ("fails", planner.failure_probability, "FAILED", 0.0),
            ("late", planner.delay_probability, "", planner.delay_s),
        )
        options = make_options("plans", *(make_fault(name, weight) for name, weight, *_ in faults if weight))
        if len(options) == 1:
            return "", 0.0
        chosen_name = self.choices.choose(ChoiceKind.PLANNER, f"{env}: plan for {problem}", options).name
        outcomes = {name: (status, delay_s) for name, _, status, delay_s in faults}
        return outcomes.get(chosen_name, ("", 0.0))  # the usual option "plans" is no fault

    @property
    def watchers(self) -> list[AgentWatcher]:
        """The watchers of a team's agents. A single agent is never killed."""
        return self.assembly.watchers if isinstance(self.assembly, Team) else []

    def joined(self, agent: Run) -> None:
        """Make the world of an agent that starts or restarts."""
        prefix = f"{agent.name}/" if isinstance(self.assembly, Team) else ""
        self._agent_worlds[agent.name] = AgentWorld(self._world_model, agent, self.choices, prefix)

    def left(self, agent: Run) -> None:
        """Close the world of a killed agent."""
        self._agent_worlds.pop(agent.name).close()

    def _apply_events(self) -> None:
        """Apply the events between two loops."""
        for agent_world in self._agent_worlds.values():
            agent_world.apply_events()
        for kill_choices in self._kill_choices:
            kill_choices.apply()

    def state(self) -> tuple[Hashable, ...] | None:
        """Return the state on which the next events of Skillers depend, besides interfaces.

        Times are relative to now. None means unknown: executors of a skill board have hidden progress, and a
        configured world has more pending events than Skillers have.
        """
        agents = self.assembly.agents
        if self._world_model != WorldModel() or any(agent.skill_board is not None for agent in agents):
            return None
        now_us = self.assembly.clock.now_us()
        return tuple(agent_world.skills.script.state(now_us) for agent_world in self._agent_worlds.values())

    @property
    def skill_results(self) -> list[SkillResult]:
        """The results of skill calls of the living agents, agent by agent."""
        return [
            result for agent_world in self._agent_worlds.values() for result in agent_world.skills.results
        ]

    @property
    def is_over(self) -> bool:
        """Whether root goals are finished, no skill runs, the agenda is empty and no agent will restart."""
        is_busy = any(agent_world.skills.script.running for agent_world in self._agent_worlds.values())
        return self.assembly.is_over and not is_busy and not self.awaits_restart

    @property
    def awaits_restart(self) -> bool:
        """Whether a killed agent will restart."""
        return any(kill_choices.awaits_restart for kill_choices in self._kill_choices)

    def start(self) -> None:
        """Load the agents once, without choices.

        :raises CxbridgeError: if an agent is broken.
        """
        if not self._is_started:
            self._is_started = True
            with self.assembly.loop.busy_section():
                self.assembly.start()
            self._checks.check_loaded_files()

    def play(self) -> WorldResult:
        """Play the run until its end or its timeout, or until the run cannot continue.

        :raises CxbridgeError: if an agent is broken.
        """
        assembly = self.assembly
        self.start()
        # Events at second 0, such as the first sensed values, come before the first loop.
        for agent_world in self._agent_worlds.values():
            agent_world.apply_events()
        end_us = assembly.clock.now_us() + round((self.options.timeout - self.choices.seconds) * MICROSECONDS)

        def is_done() -> bool:
            return self.is_over or self._must_stop() or assembly.clock.now_us() >= end_us

        assembly.loop.run(is_done)
        verdict = sum_up_run(
            assembly,
            self.options,
            self._loss_reason,
            None,  # no limit of a cycle has ended the run
            self._stuck_watch,
            run_seconds=self.choices.seconds,
            wall_seconds=0.0,
            is_over=self.is_over,
        )
        return WorldResult(verdict, tuple(self.choices.choices))

    def _must_stop(self) -> bool:
        """Check the run after a loop, and return whether the run is stuck or has lost a component."""
        self._checks.check_new_files()
        self._loss_reason = self.assembly.loss_reason
        # A team that waits for a restart is not stuck, since the restarted agent can change its state.
        return bool(self._loss_reason) or (not self.awaits_restart and self._stuck_watch.observe_cycle())

    def _close_agent_worlds(self) -> None:
        for agent_world in self._agent_worlds.values():
            agent_world.close()

    def close(self) -> None:
        """End the run and release all resources."""
        self._stack.close()


class AgentWorld(Closing):
    """The world of one agent.

    :param agent: an agent that is not started yet.
    :param prefix: precedes the subject of each choice, e.g. ``robot1/``; empty for a single agent.
    """

    def __init__(self, world: WorldModel, agent: Run, choices: RunChoices, prefix: str) -> None:
        with ExitStack() as stack:
            self.skills = SkillChoices(agent, world, choices, prefix, self._record_call)
            script = self.skills.script
            stack.callback(script.close)
            agent.loop.add(Hook.SKILL, script.loop)
            stack.callback(agent.loop.remove, Hook.SKILL, script.loop)
            # Several fields of an interface may be sensed, but an interface has one writer.
            writers = {
                uid: stack.enter_context(agent.board.open_for_writing(*parse_uid(uid), owner=OWNER))
                for uid in dict.fromkeys(sensed.uid for sensed in world.sensed)
            }
            for loss in world.message_losses:
                stack.enter_context(MessageChoices(loss, agent.board, choices, prefix))
            sensed_choices = [
                SensedChoices(sensed, agent, writers[sensed.uid], choices, prefix) for sensed in world.sensed
            ]
            self._absence_choices = [
                AbsenceChoices(absence, agent, script, choices, prefix) for absence in world.absences
            ]
            # The order of the choices is part of the path of a run, and must not change.
            self._event_choices: tuple[SensedChoices | AbsenceChoices, ...] = (
                *sensed_choices,
                *self._absence_choices,
            )
            self._stack = stack.pop_all()

    def _record_call(self, performer: str) -> None:
        for absence_choices in self._absence_choices:
            absence_choices.record_call(performer)

    def apply_events(self) -> None:
        """Apply the events between two loops."""
        for event_choices in self._event_choices:
            event_choices.apply()

    def close(self) -> None:
        self._stack.close()
