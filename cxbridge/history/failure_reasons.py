"""Finds why a goal has failed or was rejected during a run, in one line.

The reasons must be cheap, because each failed goal needs one: the events of failed plan-actions and sub-goals
are remembered, and facts are read only for the arguments, errors and messages in the text. ``cxbridge why``
of cxbridge-studio gives the full explanation.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Final, TypeVar

from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.history.outcome import ENDED_MODES
from cxbridge.history.tree import goal_title

REASON_TYPES: Final = (GoalTransition, PlanActionTransition)
"""The types of events for :meth:`FailureReasons.record_event`."""

MAX_LOOKUPS: Final = 100
"""The maximum number of lookups of facts in a run, as each iterates over all facts of a deftemplate."""

MAX_FAILURES: Final = 1000
"""The maximum number of failures in each table, which bounds the memory; the oldest is dropped."""

_FAILURE_OUTCOMES: Final = ("FAILED", "REJECTED")
_FAILED_STATES: Final = ("EXECUTION-FAILED", "FAILED")

FailureT = TypeVar("FailureT")

SlotReader = Callable[[str], Iterable[Mapping[str, object]]]
"""Returns the slots of the present facts of a deftemplate."""


class FailureReasons:
    """The reasons of failed goals of an environment: the latest failures below each goal.

    :param read_slots: reads facts; called while an event of this environment is processed.
    """

    def __init__(self, read_slots: SlotReader) -> None:
        self._read_slots = read_slots
        self._lookups_left = MAX_LOOKUPS
        self._failed_actions: dict[str, PlanActionTransition] = {}  # by goal
        self._failed_sub_goals: dict[str, dict[str, GoalTransition]] = {}  # by parent, then by goal

    def record_event(self, event: Event) -> None:
        """Remember a failed goal or action; forget the failures of a goal that starts again."""
        if isinstance(event, PlanActionTransition):
            if event.state in _FAILED_STATES:
                self._failed_actions[event.goal] = event
                forget_oldest(self._failed_actions)
        elif isinstance(event, GoalTransition):
            if event.mode in ENDED_MODES and event.outcome in _FAILURE_OUTCOMES:
                self._failed_sub_goals.setdefault(event.parent, {})[event.goal] = event
                # a parent may be tried for hours, with a failed sub-goal each time
                forget_oldest(self._failed_sub_goals[event.parent])
                forget_oldest(self._failed_sub_goals)
            elif event.mode != "DISPATCHED":  # the goal may be tried again, from any mode
                self._failed_actions.pop(event.goal, None)
                # a goal is EXPANDED and COMMITTED between its sub-goals, too, so these modes are no new start
                if event.mode in ("FORMULATED", "SELECTED"):
                    self._failed_sub_goals.pop(event.goal, None)

    def find_failure_reason(self, goal: GoalTransition) -> str:
        """Return why a goal that just ended has failed or was rejected; empty if not, or without a reason."""
        if goal.outcome not in _FAILURE_OUTCOMES:
            return ""
        action = self._failed_actions.get(goal.goal)
        if action is not None:
            return self._describe_action(action)
        # the rules of a goal may name the sub-goal in its error; without an error the last failed
        # sub-goal counts
        sub_goals = self._failed_sub_goals.get(goal.goal, {})
        candidates = [sub_goals[word] for word in goal.error.split() if word in sub_goals]
        if not goal.error:
            candidates = [*sub_goals.values()][-1:]
        if candidates:
            child = candidates[0]
            return f"sub-goal {goal_title(child.goal, child.goal_class)} {child.outcome.lower()}"
        # the message is written for users, the error is a symbol for rules
        message = (
            str(self._find_last_fact_slots("goal", {"id": goal.goal}).get("message", ""))
            if goal.error
            else ""
        )
        return message or goal.error

    def _describe_action(self, action: PlanActionTransition) -> str:
        """Return a failed action with the arguments and error that its fact has."""
        slots = self._find_last_fact_slots(
            "plan-action", {"goal-id": action.goal, "plan-id": action.plan, "id": action.action_id}
        )
        values = slots.get("param-values")
        arguments = values if isinstance(values, list | tuple) else ()
        error_text = str(slots.get("error-msg", ""))
        action_text = " ".join((action.action, *map(str, arguments)))
        return f"action {action_text} failed{f': {error_text}' if error_text else ''}"

    def _find_last_fact_slots(self, template: str, key: Mapping[str, str]) -> Mapping[str, object]:
        """Return the slots of the last fact with the key; empty without a fact, or after too many lookups."""
        if self._lookups_left <= 0:
            return {}
        self._lookups_left -= 1
        last_slots: Mapping[str, object] = {}
        for slots in self._read_slots(template):
            if all(str(slots.get(slot)) == value for slot, value in key.items()):
                last_slots = slots
        return last_slots


def forget_oldest(failures: dict[str, FailureT]) -> None:
    """Drop the oldest failure if there are more than :data:`MAX_FAILURES`."""
    if len(failures) > MAX_FAILURES:
        del failures[next(iter(failures))]
