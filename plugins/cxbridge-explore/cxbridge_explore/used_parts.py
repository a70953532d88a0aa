"""Records the parts of agents that runs use: rules, modes and outcomes of goals, actions, and skills."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from cxbridge.events import Event, EventBus, GoalTransition, PlanActionTransition, RuleFired, SkillStatus
from cxbridge.run.agent import Run

# The kind of a part, its name, and the mode or outcome of a goal (empty for other kinds). The kinds are the
# names of the counts in `cxbridge_studio.explain.coverage.model.RecordedUse`.
UsedPart = tuple[str, str, str]

_EVENT_TYPES: Final = (RuleFired, GoalTransition, PlanActionTransition, SkillStatus)


class UseWatch:
    """Records the parts of agents that a run uses, each once. A forked copy of the run keeps the record.

    :param agents: the agents, which are not started yet.
    """

    def __init__(self, bus: EventBus, agents: Iterable[Run]) -> None:
        self._used_parts: set[UsedPart] = set()
        self._reported_parts: set[UsedPart] = set()
        bus.subscribe(self._record, *_EVENT_TYPES)
        for agent in agents:  # the configuration of an agent may switch off the events of fired rules
            agent.executive.env.watcher.rules.set((), on=True)

    def take_new_parts(self) -> tuple[UsedPart, ...]:
        """Return the parts that were used for the first time since the last call."""
        new_parts = self._used_parts - self._reported_parts
        self._reported_parts |= new_parts
        return tuple(new_parts)

    def _record(self, event: Event) -> None:
        match event:
            case RuleFired():
                self._add_part("firings", event.rule)
            case GoalTransition():
                self._add_part("modes", event.goal_class, event.mode)
                if event.mode == "FINISHED":
                    self._add_part("outcomes", event.goal_class, event.outcome)
            case PlanActionTransition(state="RUNNING"):
                # in lower case, like the names of a parsed PDDL domain, with which the coverage compares
                self._add_part("actions", event.action.lower())
            case SkillStatus(status="S_RUNNING"):
                self._add_part("skills", event.skill_string.partition("{")[0].strip())

    def _add_part(self, kind: str, name: str, detail: str = "") -> None:
        self._used_parts.add((kind, name, detail))
