"""What became of the goals and plan-actions of a run, for tests to look at."""

from __future__ import annotations

from dataclasses import dataclass, field

from cxbridge.clock import MICROSECONDS
from cxbridge.events import Event, EventBus, GoalTransition, PlanActionTransition
from cxbridge.history.forest import Forest, parent_id


@dataclass(slots=True)
class Goal:
    """A goal, as it was seen last; it goes on changing while the run does.

    :ivar history: seconds since the run began, mode and outcome of each transition.
    """

    id: str
    goal_class: str
    parent: str = "nil"
    mode: str = ""
    outcome: str = ""
    error: str = ""
    history: list[tuple[float, str, str]] = field(default_factory=list)

    @property
    def modes(self) -> list[str]:
        """The modes that it went through, each once in a row."""
        modes: list[str] = []
        for _, mode, _ in self.history:
            if not modes or modes[-1] != mode:
                modes.append(mode)
        return modes

    def __str__(self) -> str:
        known = self.outcome not in ("", "UNKNOWN")
        error = f"  [{self.error}]" if self.error else ""
        return f"{self.id} ({self.goal_class}): {self.mode}{f' {self.outcome}' if known else ''}{error}"


@dataclass(slots=True)
class Action:
    """A plan-action, as it was seen last.

    :ivar states: the states that it went through.
    """

    id: str
    name: str
    goal: str
    plan: str
    state: str = ""
    states: list[str] = field(default_factory=list)


class GoalBook:
    """Follows the goals and plan-actions of a run.

    :param bus: the run's.
    :param start_us: when the run began.
    """

    def __init__(self, bus: EventBus, start_us: int) -> None:
        self.goals: dict[str, Goal] = {}
        self.actions: dict[tuple[str, str, str], Action] = {}
        self._start_us = start_us
        bus.subscribe(self._note, GoalTransition, PlanActionTransition)

    def _note(self, event: Event) -> None:
        if isinstance(event, GoalTransition):
            goal = self.goals.setdefault(event.goal, Goal(event.goal, event.goal_class))
            goal.parent, goal.mode = event.parent, event.mode
            goal.outcome, goal.error = event.outcome, event.error
            goal.history.append(((event.time_us - self._start_us) / MICROSECONDS, event.mode, event.outcome))
        elif isinstance(event, PlanActionTransition):
            key = (event.goal, event.plan, event.action_id)
            action = self.actions.setdefault(
                key, Action(event.action_id, event.action, event.goal, event.plan)
            )
            action.state = event.state
            action.states.append(event.state)

    def tree(self) -> list[str]:
        """Return the goals as lines, those of a parent below it."""
        forest = Forest({name: parent_id(goal.parent) for name, goal in self.goals.items()})
        return [f"{'  ' * depth}{self.goals[name]}" for name, depth in forest.walk()] or ["no goal yet"]
