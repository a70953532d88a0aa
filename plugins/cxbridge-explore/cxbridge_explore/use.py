"""The parts of agents that runs use: rules, modes and outcomes of goals, actions, skills."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.events import Event, EventBus, GoalTransition, PlanActionTransition, RuleFired, SkillStatus
from cxbridge.run.agent import Run

# The kind of a part, its name, and the mode or outcome of a goal. The kinds are the names of the counts in
# `cxbridge_studio.explain.coverage.model.RecordedUse`.
Used = tuple[str, str, str]

_EVENTS: Final = (RuleFired, GoalTransition, PlanActionTransition, SkillStatus)


class UseWatch:
    """Records the parts of an agent that a run uses. A forked process keeps the record.

    :param agents: the agents, which are not started yet.
    """

    def __init__(self, bus: EventBus, agents: Iterable[Run]) -> None:
        self._seen: set[Used] = set()
        self._new_parts: list[Used] = []
        bus.subscribe(self._record, *_EVENTS)
        for agent in agents:  # the agent's configuration may switch the watching off
            agent.executive.env.watcher.rules.set((), on=True)

    def new_parts(self) -> tuple[Used, ...]:
        """Return the parts that were used for the first time since the last call."""
        parts = tuple(self._new_parts)
        self._new_parts.clear()
        return parts

    def _record(self, event: Event) -> None:
        match event:
            case RuleFired():
                self._note("firings", event.rule)
            case GoalTransition():
                self._note("modes", event.goal_class, event.mode)
                if event.mode == "FINISHED":
                    self._note("outcomes", event.goal_class, event.outcome)
            case PlanActionTransition(state="RUNNING"):
                self._note("actions", event.action.lower())
            case SkillStatus(status="S_RUNNING"):
                self._note("skills", event.skill_string.partition("{")[0].strip())

    def _note(self, kind: str, name: str, detail: str = "") -> None:
        used = kind, name, detail
        if used not in self._seen:
            self._seen.add(used)
            self._new_parts.append(used)
