"""The goals of a run as their transitions tell them: with plans, actions, skills, parents and sub-goals."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge.events import GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.explain.evidence import History, SkillError, Step
from cxbridge.explain.lookup import similar
from cxbridge.goaltree import Forest, parent_id

ENDED: Final = ("FINISHED", "EVALUATED", "RETRACTED")
DONE: Final = ("FINAL", "FAILED")

_SKILL_STARTS: Final = "S_RUNNING"
_SKILL_ENDS: Final = ("S_FINAL", "S_FAILED")


@dataclass(slots=True)
class SkillRun:
    """A skill that a Skiller ran.

    :param status: the last that was seen.
    :param error: what the Skiller gave as the reason of its failure.
    """

    skiller: str
    skill_string: str
    started_us: int
    status: str = _SKILL_STARTS
    ended_us: int | None = None
    error: str = ""


@dataclass(slots=True)
class Action:
    """An action of a plan: its transitions, and the skill that executed it."""

    action_id: str
    plan: str
    name: str
    steps: list[Step] = field(default_factory=list)
    skill: SkillRun | None = None

    @property
    def state(self) -> str:
        """Its last state."""
        return self.event.state

    @property
    def event(self) -> PlanActionTransition:
        """Its last transition."""
        event = self.steps[-1].event
        assert isinstance(event, PlanActionTransition)
        return event


@dataclass(slots=True)
class Goal:
    """A goal: its transitions, its actions in the order in which they appeared, its sub-goals."""

    goal: str
    steps: list[Step] = field(default_factory=list)
    actions: list[Action] = field(default_factory=list)
    children: list[Goal] = field(default_factory=list)

    @property
    def event(self) -> GoalTransition:
        """Its last transition."""
        event = self.steps[-1].event
        assert isinstance(event, GoalTransition)
        return event

    @property
    def title(self) -> str:
        """Its id and class."""
        return f"{self.goal} ({self.event.goal_class})"

    @property
    def ended(self) -> Step | None:
        """The transition by which it got the outcome that it has; None when it has none (any more)."""
        found = None
        for step in reversed(self.steps):
            if not isinstance(step.event, GoalTransition) or step.event.mode not in ENDED:
                break
            found = step
        return found

    @property
    def former_ends(self) -> list[Step]:
        """The transitions by which it got outcomes before: a goal may be formulated again."""
        last = self.ended
        return [
            step
            for step in self.steps
            if isinstance(step.event, GoalTransition) and step.event.mode == "FINISHED" and step is not last
        ]


class Goals:
    """All goals of a history."""

    def __init__(self, history: History) -> None:
        self.by_id: dict[str, Goal] = {}
        self._actions: dict[tuple[str, str, str], Action] = {}
        self._running: dict[str, SkillRun] = {}
        self._loose: list[SkillRun] = []
        for step in history.steps:
            self._take(step)
        forest = Forest({name: parent_id(goal.event.parent) for name, goal in self.by_id.items()})
        for name, children in forest.children.items():
            self.by_id[name].children = [self.by_id[child] for child in children]
        self._skill_errors(history.skill_errors)

    def parent(self, goal: Goal) -> Goal | None:
        """Return the goal above a goal; None when there is none."""
        above = parent_id(goal.event.parent)
        return None if above is None else self.by_id.get(above)

    def _take(self, step: Step) -> None:
        event = step.event
        if isinstance(event, GoalTransition):
            self.by_id.setdefault(event.goal, Goal(event.goal)).steps.append(step)
        elif isinstance(event, SkillStatus):
            self._take_skill(event)
        else:
            key = (event.goal, event.plan, event.action_id)
            action = self._actions.get(key)
            if action is None:
                action = self._actions[key] = Action(event.action_id, event.plan, event.action)
                goal = self.by_id.get(event.goal)
                if goal is not None:
                    goal.actions.append(action)
            before = action.state if action.steps else ""
            action.steps.append(step)
            if event.state == "RUNNING" and before == "WAITING" and self._loose:
                # the skill is seen to run first, then the action
                action.skill = self._loose.pop(0)

    def _take_skill(self, event: SkillStatus) -> None:
        running = self._running.get(event.skiller)
        if event.status == _SKILL_STARTS:
            if running is None or running.skill_string != event.skill_string or running.ended_us:
                run = SkillRun(event.skiller, event.skill_string, event.time_us)
                self._running[event.skiller] = run
                # one that no action has taken by now ran for nobody here
                self._loose = [other for other in self._loose if other.skiller != event.skiller]
                self._loose.append(run)
        elif event.status in _SKILL_ENDS and running is not None and running.ended_us is None:
            running.status, running.ended_us = event.status, event.time_us

    def _skill_errors(self, errors: Iterable[SkillError]) -> None:
        runs = [action.skill for action in self._actions.values() if action.skill is not None]
        for error in errors:
            for run in runs:
                over_us = run.ended_us if run.ended_us is not None else error.time_us
                if run.skiller == error.skiller and run.started_us <= error.time_us <= over_us:
                    run.error = error.text

    def find(self, name: str) -> list[Goal]:
        """Return the goal of an id, or of the begin of one, or all of a class, or one of those: ``CLASS#2``.

        :raises CxbridgeError: when there is none, or several ids begin so.
        """
        if name in self.by_id:
            return [self.by_id[name]]
        goal_class, _, number = name.rpartition("#")
        of_class = self.of_class(goal_class if number.isdigit() and goal_class else name)
        if of_class and not (number.isdigit() and goal_class):
            return of_class
        if of_class:
            if 1 <= int(number) <= len(of_class):
                return [of_class[int(number) - 1]]
            raise CxbridgeError(
                f"there is no goal '{name}'", hint=f"of class {goal_class} there are {len(of_class)}"
            )
        begins = [goal for goal in self.by_id if goal.startswith(name)]
        if len(begins) == 1:
            return [self.by_id[begins[0]]]
        if begins:
            listed = ", ".join(begins[:10])
            raise CxbridgeError(f"several goals begin with '{name}'", hint=f"which of: {listed}")
        names = similar(name, [*self.by_id, *{goal.event.goal_class for goal in self.by_id.values()}])
        raise CxbridgeError(
            f"there is no goal '{name}'", hint=f"did you mean {', '.join(names)}?" if names else None
        )

    def of_class(self, goal_class: str) -> list[Goal]:
        """Return the goals of a class, in the order they appeared."""
        return [goal for goal in self.by_id.values() if goal.event.goal_class == goal_class]

    def named_in(self, text: str, but: Goal) -> list[Goal]:
        """Return the goals whose ids are words of an error."""
        return [self.by_id[word] for word in text.split() if word in self.by_id and word != but.goal]


def failed_actions(actions: Sequence[Action]) -> list[Action]:
    """Return the actions that have failed."""
    return [action for action in actions if action.state in ("FAILED", "EXECUTION-FAILED")]
