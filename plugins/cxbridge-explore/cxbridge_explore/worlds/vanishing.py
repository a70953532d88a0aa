"""Choices about Skillers and executors that vanish, and about agents that are killed."""

from __future__ import annotations

import math

from cxbridge.run.agent import Run
from cxbridge.run.team import Team
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.testing.scripted import ScriptedSkillers
from cxbridge_explore.worldmodel.model import Absence, DecisionTimes, Kill
from cxbridge_explore.worlds.points import ChoiceKind, RunChoices, make_fault, make_options


class Schedule:
    """Keeps track of the moments of decisions."""

    def __init__(self, times: DecisionTimes) -> None:
        self._times = times
        self._next_s = times.begin_s

    def take_due(self, seconds: float) -> bool:
        """Return whether a decision is due, and advance to the next moment if so."""
        if not self._next_s <= seconds <= self._times.end_s:
            return False
        # A loop of the executive may be longer than the period. Missed moments are skipped.
        while self._times.period_s and self._next_s <= seconds:
            self._next_s += self._times.period_s
        return True


class AbsenceChoices:
    """Lets a Skiller or an executor vanish and return.

    :param prefix: precedes the subject of each choice, e.g. ``robot1/``.
    """

    def __init__(
        self, absence: Absence, agent: Run, skills: ScriptedSkillers, choices: RunChoices, prefix: str
    ) -> None:
        self._absence, self._agent, self._skills, self._choices = absence, agent, skills, choices
        self._subject = f"{prefix}{absence.name}"
        self._schedule = None if absence.times is None else Schedule(absence.times)
        self._options = make_options("stays", make_fault("vanishes", absence.probability))
        self._has_begun_call = False
        # the second of the return; infinite for no return, None if present
        self._return_s: float | None = None

    def record_call(self, performer: str) -> None:
        """Record the start of a call.

        :param performer: the name of the Skiller, or of the agent on the skill board.
        """
        # executors on a skill board have names such as AGENT-EXECUTOR
        if self._absence.name == performer or self._absence.name.startswith(f"{performer}-"):
            self._has_begun_call = True

    def apply(self) -> None:
        """Decide whether the absence begins if a decision is due, and end an absence whose time is over."""
        has_begun_call, self._has_begun_call = self._has_begun_call, False
        seconds = self._choices.seconds
        if self._return_s is not None:
            if self._return_s <= seconds:
                self._come_back()
            return
        is_due = has_begun_call if self._schedule is None else self._schedule.take_due(seconds)
        if is_due:
            option = self._choices.choose(ChoiceKind.SKILLER, self._subject, self._options)
            if option.name == "vanishes":
                self._vanish()

    def _vanish(self) -> None:
        return_after_s = self._absence.return_after_s
        self._return_s = self._choices.seconds + (math.inf if return_after_s is None else return_after_s)
        service, name = self._agent.skill_service, self._absence.name
        for host in () if service is None else service.hosts:
            if service is not None and host.name == name:  # type checkers need the first test
                service.remove(host, ExecutorHost.abandon)
                return
        self._skills.vanish(name)

    def _come_back(self) -> None:
        self._return_s = None
        agent, name = self._agent, self._absence.name
        board, service = agent.skill_board, agent.skill_service
        for member in () if board is None else board.agents:
            for executor in member.executors:
                if executor.name == name and service is not None:
                    service.add(
                        executor.make_host(
                            member.name,
                            agent.board,
                            agent.clock,
                            agent.bus,
                            verbatim=service.skill_board.is_verbatim,
                        )
                    )
                    return
        self._skills.come_back(name)


class KillChoices:
    """Kills agents of a team and restarts them."""

    def __init__(self, kill: Kill, team: Team, choices: RunChoices) -> None:
        self._kill, self._team, self._choices = kill, team, choices
        self._schedule = Schedule(kill.times)
        self._options = make_options("lives", make_fault("killed", kill.probability))
        # the second of each restart and the name of the agent, in the order of time
        self._restarts: list[tuple[float, str]] = []

    @property
    def awaits_restart(self) -> bool:
        """Whether a killed agent will restart."""
        return bool(self._restarts)

    def apply(self) -> None:
        """Restart the agents that are due, and decide whether to kill each agent if a decision is due."""
        for restart_s, name in list(self._restarts):
            if restart_s <= self._choices.seconds:
                self._restarts.remove((restart_s, name))
                self._team.restart(name)
        if not self._schedule.take_due(self._choices.seconds):
            return
        for agent in self._team.agents:
            # A run without an agent has no end, so the last agent is killed only if it restarts.
            is_dispensable = len(self._team.agents) > 1 or self._kill.restart_after_s is not None
            if self._kill.agent in ("*", agent.name) and is_dispensable:
                self._decide_kill(agent)

    def _decide_kill(self, agent: Run) -> None:
        if self._choices.choose(ChoiceKind.KILL, agent.name, self._options).name == "killed":
            if self._kill.restart_after_s is not None:
                self._restarts.append((self._choices.seconds + self._kill.restart_after_s, agent.name))
            self._team.kill(agent)
