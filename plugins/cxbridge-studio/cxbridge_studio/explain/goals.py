"""The goals of a run by name, each with its parent, sub-goals, rules, skills and planner calls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge.events import PlannerCall
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.linking import SkillLink, links
from cxbridge.history.model import (
    ActionChange,
    GoalChange,
    GoalRecord,
    PlanActionRecord,
    PlannerExecution,
    SkillExecution,
    goal_forest,
    goals_named,
)
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.explain.action_diagnosis import FAILED_STATES, ActionDiagnosis
from cxbridge_studio.explain.evidence import History

_MAX_LISTED: Final = 10  # limit of the goals in a hint


class Goals:
    """The goals of a history, linked with everything that happened for them."""

    def __init__(self, history: History) -> None:
        # The events are numbered by their position in this list: `seq` of a change is an index into it.
        self._steps = list(history.steps)
        run = RunHistory.of((step.event for step in self._steps), UNLIMITED)
        self.all = run.goals
        self._forest = goal_forest(run.goals)
        self._run = run
        self._skills = {link.action.number: link for link in links(run)}

    def parent(self, goal: GoalRecord) -> GoalRecord | None:
        parent_number = self._forest.parents[goal.number]
        return None if parent_number is None else self.all[parent_number]

    def children(self, goal: GoalRecord) -> Sequence[GoalRecord]:
        return [self.all[number] for number in self._forest.children.get(goal.number, ())]

    def count_below(self, goal: GoalRecord) -> int:
        """Return the number of sub-goals on all levels."""
        return sum(1 for _ in self._forest.walk([goal.number])) - 1

    def skill(self, action: PlanActionRecord) -> SkillLink | None:
        """Return the link to the last skill that executed an action, or None if it is unknown."""
        return self._skills.get(action.number)

    def open_calls(self) -> Iterator[tuple[SkillExecution, PlanActionRecord | None]]:
        """Yield the skills that are executed now, each with its action if that is known."""
        actions = {id(link.call): link.action for link in self._skills.values()}
        for call in self._run.calls:
            if call.end is None:
                yield call, actions.get(id(call))

    def open_plannings(self) -> list[PlannerExecution]:
        """Return the planner calls without an answer."""
        return [call for call in self._run.planner_calls if call.end is None]

    def actions_named(self, name: str) -> list[tuple[GoalRecord, PlanActionRecord]]:
        """Return the plan-actions that ``GOAL/ID``, or ``GOAL/ACTION``, stands for, each with its goal.

        :raises CxbridgeError: if no plan-action has this name.
        """
        goal_name, _, action_name = name.rpartition("/")
        matches = [
            (goal, action)
            for goal in (self.find(goal_name) if goal_name else self.all)
            for action in goal.actions
            if action_name in (action.id, action.name)
        ]
        if not matches:
            raise CxbridgeError(f"there is no plan-action '{name}'", hint="name its goal and its id: GOAL/ID")
        return matches

    def rules(self, change: GoalChange | ActionChange) -> tuple[str, ...]:
        """Return the rules that fired just before a change, the latest last."""
        return self._steps[change.seq].rules

    def diagnosis(self, action: PlanActionRecord) -> ActionDiagnosis | None:
        """Return the diagnosis of an action when it failed, or None if it is unknown."""
        diagnoses = (self._steps[change.seq].diagnosis for change in reversed(action.changes))
        return next((diagnosis for diagnosis in diagnoses if diagnosis is not None), None)

    def planner_calls(self, goal: GoalRecord) -> Iterator[PlannerCall]:
        """Yield the results of planner calls for a goal, in order."""
        begin, end = goal.changes[0].seq, len(self._steps) if goal.replaced is None else goal.replaced
        for step in self._steps[begin:end]:
            event = step.event
            if isinstance(event, PlannerCall) and event.goal == goal.id and event.status != "started":
                yield event

    def time_us(self, seq: int) -> int:
        """Return the time of the run's clock at a change, or at the start or end of a skill."""
        return self._steps[seq].event.time_us

    def find(self, name: str, *, now: bool = False) -> list[GoalRecord]:
        """Return the goals with a name; see :func:`~cxbridge.history.model.goals_named`.

        :param now: whether to return only the latest goal if the name is an id.
        :raises CxbridgeError: if there is no such goal, or several ids have this prefix.
        """
        matches = goals_named(self.all, name)
        stem = name.rpartition("#")[0]
        if not matches:
            all_names = dict.fromkeys(word for goal in self.all for word in (goal.id, goal.goal_class))
            size_of_class = len(self.of_class(stem))
            hint = (
                f"there are {size_of_class} of this class" if size_of_class else did_you_mean(name, all_names)
            )
            raise CxbridgeError(f"there is no goal '{name}'", hint=hint or None)
        # Goals that share only the beginning of their ids have nothing in common: the user must choose.
        if not {matches[0].id, matches[0].goal_class} & {name, stem} and len(matches) > 1:
            listed = ", ".join(goal.name for goal in matches[:_MAX_LISTED])
            raise CxbridgeError(f"several goals begin with '{name}'", hint=f"name one of: {listed}")
        return matches[-1:] if now and matches[0].id == name else matches

    def of_class(self, goal_class: str) -> list[GoalRecord]:
        """Return the goals of a class, in order of appearance."""
        return [goal for goal in self.all if goal.goal_class == goal_class]

    def named_in(self, change: GoalChange, goal: GoalRecord) -> list[GoalRecord]:
        """Return the other goals whose ids are words in the error of a goal's change.

        The core writes ``SUB-GOAL-FAILED ID`` into the error of a parent.
        """
        # An id may be used again, so the latest goal at the time of the change counts.
        goals_by_id = {record.id: record for record in self.all if record.changes[0].seq <= change.seq}
        words = change.error.split()
        return [goals_by_id[word] for word in words if word in goals_by_id and word != goal.id]


def failed_actions(actions: Sequence[PlanActionRecord]) -> list[PlanActionRecord]:
    return [action for action in actions if action.state in FAILED_STATES]
