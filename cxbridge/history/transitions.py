"""Makes transitions of facts: finds the assertions of goals, plan-actions and Skillers that mean a change.

CLIPS retracts and asserts a fact for every modified slot, so most assertions of a goal change nothing that
a person would call its state. :class:`TransitionTracker` remembers the last state and reports changes. The
live executive and the reader of text logs use the same tracker: a run and its log have the same transitions.
"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from typing import Final, Generic, TypeAlias, TypeVar

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clipstext.goal_slots import GOAL_SLOTS
from cxbridge.events import FactChange, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.history.forest import NO_PARENT

Transition: TypeAlias = GoalTransition | PlanActionTransition | SkillStatus
"""The transitions that the tracker reports."""

TRANSITION_TYPES = (GoalTransition, PlanActionTransition, SkillStatus)
"""The classes of :data:`Transition`, for ``isinstance`` and for subscribing."""

TRACKED_TEMPLATES: Final[Mapping[str, tuple[str, ...]]] = {
    "SkillerInterface": ("id", "skill_string", "msgid", "status"),
    "goal": tuple(slot.name for slot in GOAL_SLOTS),
    "plan-action": ("goal-id", "plan-id", "id", "action-name", "state", "param-values"),
}
"""The deftemplates whose facts can mean a transition, and the slots that show it; no other fact, and no other
slot, need be shown to the tracker."""

CALL_TEMPLATES: Final[Mapping[str, tuple[str, ...]]] = {
    "skill": ("id", "skiller", "msgid"),
    "skill-board-call": ("goal-id", "plan-id", "action-id", "id"),
    "skill-action-execinfo": ("goal-id", "plan-id", "action-id", "skill-id", "skiller"),
}
"""The deftemplates whose facts say which message sent a plan-action to which Skiller, or to the skill board,
and their slots. The cores assert them before an answer moves the action on."""

FORGETFUL_TEMPLATES: Final[Mapping[str, tuple[str, ...]]] = {
    "goal": ("id",),
    "plan-action": ("goal-id", "plan-id", "id"),
}
"""The deftemplates whose retractions the tracker wants to see, so that it can forget, and their slots."""

MAX_RETIRED: Final = 1000
"""The number of removed facts that are remembered; then the oldest is forgotten."""

Key = TypeVar("Key")
State = TypeVar("State")


NOT_SENT: Final = ("FORMULATED", "PENDING")
"""States of a plan-action that no message has been sent for."""

_FIELDS: Final = (
    *("id", "class", "sub-type", "parent", "mode", "outcome", "error"),
    *("params", "meta", "priority", "required-resources"),
)
"""The slots of goals that are fields of the event."""

_FURTHER: Final = tuple(slot for slot in GOAL_SLOTS if slot.name not in _FIELDS)

_GOAL_STATE: Final = ("mode", "outcome", "parent", "error")


class _Memory(Generic[Key, State]):
    """The last state of each fact. A modified fact is retracted and asserted: what went is kept a while."""

    def __init__(self) -> None:
        self._states: dict[Key, State] = {}
        self._retired: dict[Key, bool] = {}
        self.is_first = False
        """Whether there was no fact of the last key before, or it was gone for good."""

    def __len__(self) -> int:
        return len(self._states) + len(self._retired)

    def is_new(self, key: Key, state: State) -> bool:
        """Take over the state of a fact that was asserted; return whether it had another one."""
        self.is_first = self._retired.pop(key, False) or key not in self._states
        if self._states.get(key) == state:
            return False
        self._states[key] = state
        return True

    def retire(self, key: Key, *, gone: bool = False) -> None:
        """Note that the fact was retracted.

        :param gone: for good, not to be asserted with other slots.
        """
        if key in self._states:
            self._retired.pop(key, None)
            self._retired[key] = gone
            if len(self._retired) > MAX_RETIRED:
                oldest = next(iter(self._retired))
                del self._retired[oldest], self._states[oldest]


class TransitionTracker:
    """Says which asserted facts are transitions.

    Slots are given as CLIPS prints their values: strings in quotes (bare ones are taken too), the fields of
    a multislot joined by blanks, an empty multislot as an empty text. A fact that lacks a slot the tracker
    needs is of a foreign template, and is ignored.

    :param env: name of the CLIPS environment the facts live in.
    """

    def __init__(self, env: str) -> None:
        self.env = env
        self._goals: _Memory[str, tuple[str, ...]] = _Memory()
        self._actions: _Memory[tuple[str, str, str], str] = _Memory()
        self._skills: dict[tuple[str, str], str] = {}
        self._calls: dict[tuple[str, str, str], tuple[str, str]] = {}
        self._last_gone = ""

    def __len__(self) -> int:
        """Return how many entries its tables have: bounded by the facts there are, and those just gone."""
        return len(self._goals) + len(self._actions)

    def fact(self, time_us: int, template: str, slots: Mapping[str, str]) -> Transition | None:
        """Return the transition that asserting this fact means, None when it means none.

        :param time_us: when, on the run's clock.
        """
        try:
            if template == "goal":
                return self.goal(time_us, slots)
            if template == "plan-action":
                return self.plan_action(time_us, slots)
            if template == "SkillerInterface":
                return self.skiller(time_us, slots)
            if template == "skill":
                _note(self._skills, (slots["id"], _skiller_of(slots)), slots.get("msgid", slots["id"]))
            elif template == "skill-action-execinfo":
                skiller = _skiller_of(slots)
                call = self._skills.get((slots["skill-id"], skiller), "0")
                # what sent nothing has no message
                _note(self._calls, _sent_key(slots), ("", "") if call == "0" else (skiller, call))
            elif template == "skill-board-call":
                _note(self._calls, _sent_key(slots), ("", slots["id"]))
        except (KeyError, ValueError):
            return None
        return None

    def change(self, event: FactChange) -> Transition | None:
        """Return the transition that a printed change of a fact means, None when it means none.

        :raises FactSyntaxError: when the fact of a goal, plan-action or Skiller cannot be read.
        """
        before, self._last_gone = self._last_gone, ""
        if event.asserted and event.template in TRACKED_TEMPLATES:
            slots = parse_fact(event.text)[1]
            if before and (event.template != "goal" or slots.get("id") != before):
                self._goals.retire(before, gone=True)  # no modify: that asserts the fact at once
            return self.fact(event.time_us, event.template, slots)
        if before:
            self._goals.retire(before, gone=True)
        if event.asserted and event.template in CALL_TEMPLATES:
            with suppress(FactSyntaxError):
                self.fact(event.time_us, *parse_fact(event.text))
        elif not event.asserted and event.template in FORGETFUL_TEMPLATES:
            slots = parse_fact(event.text)[1]
            self.retracted(event.template, slots)
            self._last_gone = slots.get("id", "") if event.template == "goal" else ""
        return None

    def retracted(self, template: str, slots: Mapping[str, str], *, gone: bool = False) -> None:
        """Note that a fact is gone, of one of :data:`FORGETFUL_TEMPLATES`; later it is forgotten.

        :param gone: for good: no ``modify`` asserts it with other slots.
        """
        try:
            if template == "goal":
                self._goals.retire(slots["id"], gone=gone)
            elif template == "plan-action":
                self._actions.retire(_action_key(slots))
        except KeyError:
            return

    def goal(self, time_us: int, slots: Mapping[str, str]) -> GoalTransition | None:
        """Return a transition when mode, outcome, parent or error of the goal is another than before.

        :raises KeyError: when a slot is missing.
        """
        goal = slots["id"]
        mode, outcome, parent, error = state = tuple(slots[name] for name in _GOAL_STATE)
        goal_class, sub_type = slots["class"], slots["sub-type"]
        if not self._goals.is_new(goal, state):
            return None
        is_first = self._goals.is_first
        return GoalTransition(
            time_us=time_us,
            env=self.env,
            goal=goal,
            goal_class=goal_class,
            sub_type=sub_type,
            parent=parent,
            mode=mode,
            outcome=outcome,
            error=error,
            params=_detail(slots, "params"),
            meta=_detail(slots, "meta"),
            priority=slots.get("priority", ""),
            resources=_detail(slots, "required-resources"),
            # a rule may retract a goal and assert it in its next mode, which is no new goal
            is_new=is_first and mode == "FORMULATED" and goal != NO_PARENT,
            slots={
                slot.name: slots[slot.name]
                for slot in _FURTHER
                if slots.get(slot.name, slot.default) != slot.default
            },
        )

    def plan_action(self, time_us: int, slots: Mapping[str, str]) -> PlanActionTransition | None:
        """Return a transition when the action (goal, plan and id name it) has another state than before.

        :raises KeyError: when a slot is missing.
        """
        key, state, action = _action_key(slots), slots["state"], slots["action-name"]
        if not self._actions.is_new(key, state):
            return None
        if state in NOT_SENT:
            self._calls.pop(key, None)  # of the plan-action that had these ids before, or of the last try
        skiller, call = self._calls.get(key, ("", ""))
        return PlanActionTransition(
            time_us=time_us,
            env=self.env,
            action_id=key[2],
            goal=key[0],
            plan=key[1],
            action=action,
            state=state,
            params=_detail(slots, "param-values"),
            skiller=skiller,
            call=call,
        )

    def skiller(self, time_us: int, slots: Mapping[str, str]) -> SkillStatus:
        """Return the status in a SkillerInterface fact; each fact is one.

        :raises KeyError: when a slot is missing.
        :raises ValueError: when the message id is not a number.
        """
        return SkillStatus(
            time_us=time_us,
            env=self.env,
            skiller=unquote(slots["id"]),
            skill_string=unquote(slots["skill_string"]),
            msgid=int(slots["msgid"]),
            status=slots["status"],
        )


def _note(table: dict[Key, State], key: Key, value: State) -> None:
    """Enter a value as the newest of a table, and forget the oldest of too many."""
    table.pop(key, None)
    table[key] = value
    if len(table) > MAX_RETIRED:
        del table[next(iter(table))]


def _skiller_of(slots: Mapping[str, str]) -> str:
    """Return the id of the Skiller in a fact; empty where a skill board takes the calls."""
    return unquote(slots.get("skiller", ""))


def _sent_key(slots: Mapping[str, str]) -> tuple[str, str, str]:
    return slots["goal-id"], slots["plan-id"], slots["action-id"]


def _action_key(slots: Mapping[str, str]) -> tuple[str, str, str]:
    return slots["goal-id"], slots["plan-id"], slots["id"]


def _detail(slots: Mapping[str, str], name: str) -> str:
    """Return the content of a slot in parentheses; empty when the deftemplate has no such slot."""
    value = slots.get(name)
    return "" if value is None else f"({value})"


def unquote(text: str) -> str:
    """Return the content of a string that CLIPS printed in quotes; any other text unchanged.

    CLIPS 6.30 does not escape quotes within a string when it prints facts, so only the outer pair goes.
    """
    if len(text) > 1 and text[0] == text[-1] == '"':
        return text[1:-1]
    return text
