"""Choices about the presence and the order of agents, Skillers and executors."""

from __future__ import annotations

from itertools import permutations

from cxbridge.run.agent import Run
from cxbridge.run.team import Team
from cxbridge.skiller.board.host import ExecutorHost
from cxbridge.testing.scripted import ScriptedSkills
from cxbridge_explore.worldmodel.model import Absence, Kill, Times
from cxbridge_explore.worlds.asking import Asking, Schedule, fault, unless
from cxbridge_explore.worlds.points import ChoiceKind, Option


class AbsenceChoices:
    """Lets a Skiller or an executor vanish and return.

    :param prefix: the prefix of its subjects.
    """

    def __init__(
        self, absence: Absence, agent: Run, skills: ScriptedSkills, ask: Asking, prefix: str
    ) -> None:
        self._absence, self._agent, self._skills, self._ask = absence, agent, skills, ask
        self._subject = f"{prefix}{absence.name}"
        self._schedule = None if absence.times is None else Schedule(absence.times)
        self._options = unless("stays", fault("vanishes", absence.probability))
        self._began = False
        self._back_at: float | None = None
        self._is_gone = False

    def note(self, name: str) -> None:
        """Record the start of a call by a Skiller or an agent of the skill board."""
        if self._absence.name == name or self._absence.name.startswith(f"{name}-"):
            self._began = True

    def loop(self) -> None:
        """Choose if a decision is due, and let it return when its time has come."""
        began, self._began = self._began, False
        if self._is_gone:
            if self._back_at is not None and self._back_at <= self._ask.seconds:
                self._come_back()
            return
        is_due = began if self._schedule is None else self._schedule.is_due(self._ask.seconds)
        if is_due and self._ask(ChoiceKind.SKILLER, self._subject, self._options).name == "vanishes":
            self._vanish()

    def _vanish(self) -> None:
        self._is_gone = True
        self._back_at = None if self._absence.back is None else self._ask.seconds + self._absence.back
        service, name = self._agent.skill_service, self._absence.name
        host = next((each for each in service.hosts if each.name == name), None) if service else None
        if service is not None and host is not None:
            service.remove(host, ExecutorHost.abandon)
        else:
            self._skills.vanish(name)

    def _come_back(self) -> None:
        self._is_gone = False
        context, name = self._agent, self._absence.name
        settings, service = context.skill_board, context.skill_service
        for agent in () if settings is None else settings.agents:
            for executor in agent.executors:
                if executor.name == name and service is not None:
                    service.add(
                        executor.host(
                            agent.name, context.board, context.clock, context.bus, verbatim=service.verbatim
                        )
                    )
                    return
        self._skills.come_back(name)


class KillChoices:
    """Kills agents of a team and restarts them."""

    def __init__(self, kill: Kill, team: Team, ask: Asking) -> None:
        self._kill, self._team, self._ask = kill, team, ask
        self._schedule = Schedule(kill.times)
        self._options = unless("lives", fault("killed", kill.probability))
        self._back: list[tuple[float, str]] = []

    @property
    def is_expecting(self) -> bool:
        """Whether a killed agent will restart."""
        return bool(self._back)

    def loop(self) -> None:
        """Restart agents that are due, and choose if a decision is due."""
        while self._back and self._back[0][0] <= self._ask.seconds:
            self._team.restart(self._back.pop(0)[1])
        if not self._schedule.is_due(self._ask.seconds):
            return
        for agent in self._team.agents:
            is_meant = self._kill.agent in ("*", agent.name)
            if is_meant and (len(self._team.agents) > 1 or self._kill.back is not None):
                self._decide(agent)

    def _decide(self, agent: Run) -> None:
        if self._ask(ChoiceKind.KILL, agent.name, self._options).name == "killed":
            if self._kill.back is not None:
                self._back.append((self._ask.seconds + self._kill.back, agent.name))
            self._team.kill(agent)


class OrderChoices:
    """Changes the order of the agents' turns."""

    def __init__(self, times: Times, team: Team, ask: Asking) -> None:
        self._schedule, self._team, self._ask = Schedule(times), team, ask

    def loop(self) -> None:
        """Choose if a decision is due."""
        names = [agent.name for agent in self._team.agents]
        if not names[1:] or not self._schedule.is_due(self._ask.seconds):
            return
        orders = list(permutations(names))
        options = tuple(
            Option(", ".join(order), faults=int(number > 0), value=order)
            for number, order in enumerate(orders)
        )
        order: tuple[str, ...] = self._ask(ChoiceKind.ORDER, "turns", options).value
        if list(order) != names:
            self._team.reorder(order)
