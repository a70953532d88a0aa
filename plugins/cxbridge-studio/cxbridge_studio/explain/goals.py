"""Finds the goals of a run by name, each with its parent, sub-goals, rules, skills and planner calls."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Final

from cxbridge.errors import CxbridgeError
from cxbridge.events import PlannerCall
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.linking import SkillLink, find_skill_links
from cxbridge.history.model import (
    GoalChange,
    GoalRecord,
    PlanActionRecord,
    PlannerExecution,
    SkillExecution,
    find_goals,
    goal_forest,
)
from cxbridge.printing import format_count
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.explain.action_diagnosis import FAILED_STATES, ActionDiagnosis
from cxbridge_studio.explain.evidence import History

_MAX_LISTED: Final = 10  # limit of the goals in a hint


class UnknownGoalError(CxbridgeError):
    """A name that no goal has."""


class Goals:
    """The goals of a history, in order of appearance, with the events that belong to each.

    :ivar records: the goals; the number of a goal is its index.
    """

    def __init__(self, history: History) -> None:
        # The events are numbered by their position in this list, so the `seq` of a change is an index into
        # it.
        self._steps = list(history.steps)
        self._run = RunHistory.from_events((step.event for step in self._steps), UNLIMITED)
        self.records = self._run.goals
        self._forest = goal_forest(self.records)
        self._links_by_action = {link.action.number: link for link in find_skill_links(self._run)}

    def parent(self, goal: GoalRecord) -> GoalRecord | None:
        parent_number = self._forest.parents[goal.number]
        return None if parent_number is None else self.records[parent_number]

    def children(self, goal: GoalRecord) -> Sequence[GoalRecord]:
        return [self.records[number] for number in self._forest.children.get(goal.number, ())]

    def count_sub_goals(self, goal: GoalRecord) -> int:
        """Return the number of sub-goals on all levels."""
        return sum(1 for _ in self._forest.walk([goal.number])) - 1

    def find_skill_link(self, action: PlanActionRecord) -> SkillLink | None:
        """Return the link to the last skill that executed an action; None if the skill is unknown."""
        return self._links_by_action.get(action.number)

    def find_open_skill_calls(self) -> Iterator[tuple[SkillExecution, PlanActionRecord | None]]:
        """Yield the skills that are executed now, each with its action; None if the action is unknown."""
        actions = {id(link.call): link.action for link in self._links_by_action.values()}
        return ((call, actions.get(id(call))) for call in self._run.calls if call.end is None)

    def find_open_planner_calls(self) -> list[PlannerExecution]:
        """Return the planner calls without an answer."""
        return [call for call in self._run.planner_calls if call.end is None]

    def find_actions(self, name: str) -> list[tuple[GoalRecord, PlanActionRecord]]:
        """Return the plan-actions with a name, ``GOAL/ID`` or ``GOAL/ACTION``, each with its goal.

        Without ``GOAL/``, the plan-actions of all goals count.

        :raises CxbridgeError: if no plan-action has this name, or :meth:`find_goals` refuses the goal's name.
        """
        goal_name, _, action_name = name.rpartition("/")
        matches = [
            (goal, action)
            for goal in (self.find_goals(goal_name) if goal_name else self.records)
            for action in goal.actions
            if action_name in (action.id, action.name)
        ]
        if not matches:
            raise CxbridgeError(
                f"there is no plan-action '{name}'", hint="name the goal and the id of the action: GOAL/ID"
            )
        return matches

    def find_rules_before(self, seq: int) -> tuple[str, ...]:
        """Return the rules that fired just before a change with this number, the latest last."""
        return self._steps[seq].rules

    def find_failure_diagnosis(self, action: PlanActionRecord) -> ActionDiagnosis | None:
        """Return the diagnosis that was made when an action failed; None if there is none."""
        diagnoses = (self._steps[change.seq].diagnosis for change in reversed(action.changes))
        return next((diagnosis for diagnosis in diagnoses if diagnosis is not None), None)

    def find_planner_calls(self, goal: GoalRecord) -> Iterator[PlannerCall]:
        """Yield the results of planner calls for the present attempt of a goal, in order."""
        for step in self._steps[max(goal.changes[0].seq, goal.former_seq) : goal.replaced_seq]:
            event = step.event
            if isinstance(event, PlannerCall) and event.goal == goal.id and event.status != "started":
                yield event

    def time_us(self, seq: int) -> int:
        """Return the time of the run's clock at a change, or at the start or end of a skill."""
        return self._steps[seq].event.time_us

    def find_goals(self, name: str, *, latest_only: bool = False) -> list[GoalRecord]:
        """Return the goals with a name; see :func:`~cxbridge.history.model.find_goals`.

        :param latest_only: whether to return only the latest goal if the name is an id.
        :raises UnknownGoalError: if there is no such goal.
        :raises CxbridgeError: if the name is the beginning of several ids.
        """
        matches = find_goals(self.records, name)
        unnumbered_name = name.rpartition("#")[0]
        if not matches:
            known_names = dict.fromkeys(word for goal in self.records for word in (goal.id, goal.goal_class))
            members = self.find_class_members(unnumbered_name)
            size_text = f"the class has {format_count(len(members), 'goal')}" if members else ""
            hint = size_text or did_you_mean(name, known_names) or None
            raise UnknownGoalError(f"there is no goal '{name}'", hint=hint)
        # Goals that share only the beginning of their ids have nothing in common: the user must choose.
        if not {matches[0].id, matches[0].goal_class} & {name, unnumbered_name} and len(matches) > 1:
            listed_names = ", ".join(goal.name for goal in matches[:_MAX_LISTED])
            raise CxbridgeError(f"several goals begin with '{name}'", hint=f"name one of: {listed_names}")
        return matches[-1:] if latest_only and matches[0].id == name else matches

    def find_class_members(self, goal_class: str) -> list[GoalRecord]:
        """Return the goals of a class, in order of appearance."""
        return [goal for goal in self.records if goal.goal_class == goal_class]

    def find_goals_named_in_error(self, change: GoalChange, goal: GoalRecord) -> list[GoalRecord]:
        """Return the other goals whose ids are words in the error of a goal's change.

        The core writes ``SUB-GOAL-FAILED ID`` into the error of a parent.
        """
        # An id may be used again, so the latest goal at the time of the change counts.
        goals_by_id = {record.id: record for record in self.records if record.changes[0].seq <= change.seq}
        words = change.error.split()
        return [goals_by_id[word] for word in words if word in goals_by_id and word != goal.id]


def find_failed_actions(actions: Sequence[PlanActionRecord]) -> list[PlanActionRecord]:
    return [action for action in actions if action.state in FAILED_STATES]
