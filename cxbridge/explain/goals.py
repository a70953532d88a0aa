"""Finds goals of a run by their names, and what their histories do not have: rules, and sub-goals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cxbridge.errors import CxbridgeError
from cxbridge.explain.evidence import History
from cxbridge.history.builder import UNLIMITED, RunHistory
from cxbridge.history.forest import parent_id
from cxbridge.history.linking import links
from cxbridge.history.model import (
    ActionChange,
    GoalChange,
    GoalRecord,
    PlanActionRecord,
    SkillExecution,
    goal_forest,
)
from cxbridge.history.orders import ActionKey, ActionOrder
from cxbridge.suggestions import did_you_mean


class Goals:
    """All goals of a history.

    :param orders: what plan-actions ask for that are there now; the history may know about more.
    """

    def __init__(self, history: History, orders: Mapping[ActionKey, ActionOrder]) -> None:
        self._steps = list(history.steps)
        run = RunHistory.of((step.event for step in self._steps), UNLIMITED)
        run.set_orders(history.env, {**history.orders, **orders})
        self.by_id = {goal.id: goal for goal in run.goals}
        self._children = {
            number: [run.goals[child] for child in children]
            for number, children in goal_forest(run.goals).children.items()
        }
        self._skills = {link.action.number: link.call for link in links(run)}

    def parent(self, goal: GoalRecord) -> GoalRecord | None:
        """Return the goal above a goal; None when there is none."""
        above = parent_id(goal.parent)
        return None if above is None else self.by_id.get(above)

    def children(self, goal: GoalRecord) -> Sequence[GoalRecord]:
        """Return the goals below a goal."""
        return self._children.get(goal.number, ())

    def skill(self, action: PlanActionRecord) -> SkillExecution | None:
        """Return the skill that executed an action, the last one; None when it is not known."""
        return self._skills.get(action.number)

    def rules(self, change: GoalChange | ActionChange) -> tuple[str, ...]:
        """Return the rules that fired just before a change, the last one last."""
        return self._steps[change.seq].rules

    def time_us(self, seq: int) -> int:
        """Return what the run's clock showed at a change, or at the start or end of a skill."""
        return self._steps[seq].event.time_us

    def find(self, name: str) -> list[GoalRecord]:
        """Return the goal of an id, or of the start of one, or all of a class, or one of those: ``CLASS#2``.

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
        known = [*self.by_id, *{goal.goal_class for goal in self.by_id.values()}]
        raise CxbridgeError(f"there is no goal '{name}'", hint=did_you_mean(name, known) or None)

    def of_class(self, goal_class: str) -> list[GoalRecord]:
        """Return the goals of a class, in the order they appeared."""
        return [goal for goal in self.by_id.values() if goal.goal_class == goal_class]

    def named_in(self, text: str, but: GoalRecord) -> list[GoalRecord]:
        """Return the goals whose ids are words of an error."""
        return [self.by_id[word] for word in text.split() if word in self.by_id and word != but.id]


def failed_actions(actions: Sequence[PlanActionRecord]) -> list[PlanActionRecord]:
    """Return the actions that have failed."""
    return [action for action in actions if action.state in ("FAILED", "EXECUTION-FAILED")]
