"""One line explanations, during the run, why goals failed or were rejected.

They are cheap enough for each failed goal; ``cxbridge why`` of cxbridge-studio explains in full.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Final, TypeVar

from cxbridge.events import Event, GoalTransition, PlanActionTransition
from cxbridge.history.outcome import ENDED_MODES
from cxbridge.history.tree import goal_title

BRIEF_TYPES: Final = (GoalTransition, PlanActionTransition)
"""The types of events to process."""

# each lookup iterates over all facts of a deftemplate
MOST_LOOKS: Final = 100

Kept = TypeVar("Kept")

_BAD: Final = ("FAILED", "REJECTED")
_FAILED_STATES: Final = ("EXECUTION-FAILED", "FAILED")

MOST_KEPT: Final = 1000
"""The maximal number of remembered goals and actions; the oldest are dropped."""

FactSlots = Callable[[str], Iterable[Mapping[str, object]]]
"""Returns the slots of the present facts of a deftemplate."""


class BriefReasons:
    """The latest failures below each goal of an environment.

    :param slots_of: reads facts; called while an event of this environment is processed.
    """

    def __init__(self, slots_of: FactSlots) -> None:
        self._slots_of = slots_of
        self._looks = MOST_LOOKS
        self._actions: dict[str, PlanActionTransition] = {}
        self._below: dict[str, dict[str, GoalTransition]] = {}

    def take(self, event: Event) -> None:
        """Remember a failed goal or action."""
        if isinstance(event, PlanActionTransition):
            if event.state in _FAILED_STATES:
                self._actions[event.goal] = event
                forget_oldest(self._actions)
        elif isinstance(event, GoalTransition):
            if event.mode in ENDED_MODES and event.outcome in _BAD:
                self._below.setdefault(event.parent, {})[event.goal] = event
                forget_oldest(self._below[event.parent])
                forget_oldest(self._below)
            elif event.mode == "FORMULATED":  # the goal is tried again
                self._actions.pop(event.goal, None)
                self._below.pop(event.goal, None)

    def reason(self, goal: GoalTransition) -> str:
        """Return why a goal that just ended has failed, or an empty text."""
        if goal.outcome not in _BAD:
            return ""
        action, below = self._actions.get(goal.goal), self._below.get(goal.goal, {})
        if action is not None:
            return self._failed_action(action)
        named = [below[word] for word in goal.error.split() if word in below]
        for child in named or (() if goal.error else [*below.values()][-1:]):
            return f"sub-goal {goal_title(child.goal, child.goal_class)} {child.outcome.lower()}"
        return (self._message(goal) or goal.error) if goal.error else ""

    def _failed_action(self, action: PlanActionTransition) -> str:
        slots = self._find(
            "plan-action", {"goal-id": action.goal, "plan-id": action.plan, "id": action.action_id}
        )
        arguments = " ".join(map(str, _fields(slots.get("param-values"))))
        text = str(slots.get("error-msg", ""))
        call = " ".join(filter(None, (action.action, arguments)))
        return f"action {call} failed{f': {text}' if text else ''}"

    def _message(self, goal: GoalTransition) -> str:
        return str(self._find("goal", {"id": goal.goal}).get("message", ""))

    def _find(self, template: str, wanted: Mapping[str, str]) -> Mapping[str, object]:
        """Return the slots of the last matching fact; empty if there is none, or after too many lookups."""
        if self._looks <= 0:
            return {}
        self._looks -= 1
        found: Mapping[str, object] = {}
        for slots in self._slots_of(template):
            if all(str(slots.get(slot)) == value for slot, value in wanted.items()):
                found = slots
        return found


def forget_oldest(kept: dict[str, Kept]) -> None:
    """Drop the oldest entry if there are too many."""
    if len(kept) > MOST_KEPT:
        del kept[next(iter(kept))]


def _fields(value: object) -> tuple[object, ...]:
    return tuple(value) if isinstance(value, list | tuple) else ()
