"""Finds goals of a run by their names, and what their histories do not have: rules, and sub-goals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cxbridge.errors import CxbridgeError
from cxbridge.events import PlannerCall
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.linking import SkillLink, links
from cxbridge.history.model import (
    ActionChange,
    GoalChange,
    GoalRecord,
    PlanActionRecord,
    goal_forest,
    goals_named,
)
from cxbridge.suggestions import did_you_mean
from cxbridge_studio.explain.action_look import ActionLook
from cxbridge_studio.explain.evidence import History


class Goals:
    """All goals of a history."""

    def __init__(self, history: History) -> None:
        self._steps = list(history.steps)
        run = RunHistory.of((step.event for step in self._steps), UNLIMITED)
        self.all = run.goals
        self._forest = goal_forest(run.goals)
        self._skills = {link.action.number: link for link in links(run)}

    def parent(self, goal: GoalRecord) -> GoalRecord | None:
        """Return the goal above a goal; None when there is none."""
        above = self._forest.parents[goal.number]
        return None if above is None else self.all[above]

    def children(self, goal: GoalRecord) -> Sequence[GoalRecord]:
        """Return the goals below a goal."""
        return [self.all[number] for number in self._forest.children.get(goal.number, ())]

    def skill(self, action: PlanActionRecord) -> SkillLink | None:
        """Return the link to the last skill that executed an action; None when it is not known."""
        return self._skills.get(action.number)

    def rules(self, change: GoalChange | ActionChange) -> tuple[str, ...]:
        """Return the rules that fired just before a change, the last one last."""
        return self._steps[change.seq].rules

    def look(self, action: PlanActionRecord) -> ActionLook | None:
        """Return what facts said about an action when it failed; None when that is not known."""
        looks = (self._steps[change.seq].look for change in reversed(action.changes))
        return next((look for look in looks if look is not None), None)

    def planner_calls(self, goal: GoalRecord) -> Iterator[PlannerCall]:
        """Yield the answers of planners that were called for a goal, in order."""
        begin, end = goal.changes[0].seq, len(self._steps) if goal.replaced is None else goal.replaced
        for step in self._steps[begin:end]:
            event = step.event
            if isinstance(event, PlannerCall) and event.goal == goal.id and event.status != "started":
                yield event

    def time_us(self, seq: int) -> int:
        """Return the run's clock at a change, or at the start or end of a skill."""
        return self._steps[seq].event.time_us

    def find(self, name: str, *, now: bool = False) -> list[GoalRecord]:
        """Return the goals that a name stands for; see :func:`~cxbridge.history.model.goals_named`.

        :param now: only the last life of an id.
        :raises CxbridgeError: when there is none, or several ids begin so.
        """
        found = goals_named(self.all, name)
        if not found:
            known = dict.fromkeys(word for goal in self.all for word in (goal.id, goal.goal_class))
            of_class = len(self.of_class(name.rpartition("#")[0]))
            hint = f"there are {of_class} of this class" if of_class else did_you_mean(name, known)
            raise CxbridgeError(f"there is no goal '{name}'", hint=hint or None)
        if not {found[0].id, found[0].goal_class} & {name, name.rpartition("#")[0]} and len(found) > 1:
            listed = ", ".join(goal.name for goal in found[:10])
            raise CxbridgeError(f"several goals begin with '{name}'", hint=f"which of: {listed}")
        return found[-1:] if now and found[0].id == name else found

    def of_class(self, goal_class: str) -> list[GoalRecord]:
        """Return the goals of a class, in the order they appeared."""
        return [goal for goal in self.all if goal.goal_class == goal_class]

    def named_in(self, change: GoalChange, but: GoalRecord) -> list[GoalRecord]:
        """Return the goals whose ids are words of the error of a change, of each id the life at that time."""
        last = {goal.id: goal for goal in self.all if goal.changes[0].seq <= change.seq}
        return [last[word] for word in change.error.split() if word in last and word != but.id]


def failed_actions(actions: Sequence[PlanActionRecord]) -> list[PlanActionRecord]:
    """Return the actions that have failed."""
    return [action for action in actions if action.state in ("FAILED", "EXECUTION-FAILED")]
