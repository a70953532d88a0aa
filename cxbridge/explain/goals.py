"""The goals of a run as their transitions tell them: with plans, actions, skills, parents and sub-goals."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge.events import GoalTransition, PlanActionTransition
from cxbridge.explain.evidence import MOST_STEPS, History, SkillError, Step
from cxbridge.explain.rules.locations import similar
from cxbridge.goaltree import Forest, parent_id
from cxbridge.trace.report.model import Limits
from cxbridge.trace.report.orders import Key, Order
from cxbridge.trace.report.reading import read_events
from cxbridge.trace.timeline.linking import links

ENDED: Final = ("FINISHED", "EVALUATED", "RETRACTED")
DONE: Final = ("FINAL", "FAILED")

_ALL: Final = Limits(goals=MOST_STEPS, actions=MOST_STEPS, calls=MOST_STEPS, transitions=MOST_STEPS)


@dataclass(slots=True)
class SkillRun:
    """A skill that a Skiller ran.

    :param status: the last that was seen.
    :param error: what the Skiller gave as the reason of its failure.
    """

    skiller: str
    skill_string: str
    started_us: int
    status: str
    ended_us: int | None
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
    """All goals of a history.

    :param orders: what plan-actions ask for that are there now; the history may know of more.
    """

    def __init__(self, history: History, orders: Mapping[Key, Order]) -> None:
        self.by_id: dict[str, Goal] = {}
        self._actions: dict[tuple[str, str, str], Action] = {}
        for step in history.steps:
            self._take(step)
        forest = Forest({name: parent_id(goal.event.parent) for name, goal in self.by_id.items()})
        for name, children in forest.children.items():
            self.by_id[name].children = [self.by_id[child] for child in children]
        self._skills(history, {**history.orders, **orders})
        self._skill_errors(history.skill_errors)

    def parent(self, goal: Goal) -> Goal | None:
        """Return the goal above a goal; None when there is none."""
        above = parent_id(goal.event.parent)
        return None if above is None else self.by_id.get(above)

    def _take(self, step: Step) -> None:
        event = step.event
        if isinstance(event, GoalTransition):
            self.by_id.setdefault(event.goal, Goal(event.goal)).steps.append(step)
        elif isinstance(event, PlanActionTransition):
            key = (event.goal, event.plan, event.action_id)
            action = self._actions.get(key)
            if action is None:
                action = self._actions[key] = Action(event.action_id, event.plan, event.action)
                goal = self.by_id.get(event.goal)
                if goal is not None:
                    goal.actions.append(action)
            action.steps.append(step)

    def _skills(self, history: History, orders: Mapping[Key, Order]) -> None:
        """Find out which skill each action ran."""
        events = [step.event for step in history.steps]
        model = read_events(events, _ALL)
        for done in model.actions:
            key = done.goal_id, done.plan, done.action_id
            done.order = orders.get(key, done.order)
        for link in links(model):
            key, call = (link.action.goal_id, link.action.plan, link.action.action_id), link.call
            self._actions[key].skill = SkillRun(
                call.skiller,
                call.skill_string,
                events[call.begin[0]].time_us,
                call.status,
                None if call.end is None else events[call.end[0]].time_us,
                call.error,
            )

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
