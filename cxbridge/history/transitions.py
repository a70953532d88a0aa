"""Derives transitions from assertions of goals, plan-actions and Skillers.

Each ``modify`` retracts a fact and asserts a new one, even if no slot of the state is modified. So most
assertions of a goal do not change its state.

:class:`TransitionTracker` compares with the last state and reports changes. The live executive and the reader
of text logs use the same tracker, so a run and its log have equal transitions.
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
"""The classes of `Transition`, for ``isinstance`` and subscriptions."""

TRACKED_TEMPLATES: Final[Mapping[str, tuple[str, ...]]] = {
    "SkillerInterface": ("id", "skill_string", "msgid", "status"),
    "goal": tuple(slot.name for slot in GOAL_SLOTS),
    "plan-action": ("goal-id", "plan-id", "id", "action-name", "state", "param-values"),
}
"""The deftemplates, with the slots, that can cause a transition; the tracker needs only these facts."""

# the cores assert these facts before a reply changes the action
CALL_TEMPLATES: Final[Mapping[str, tuple[str, ...]]] = {
    "skill": ("id", "skiller", "msgid"),
    "skill-board-call": ("goal-id", "plan-id", "action-id", "id"),
    "skill-action-execinfo": ("goal-id", "plan-id", "action-id", "skill-id", "skiller"),
}
"""The deftemplates, with the slots, of messages that sent plan-actions to a Skiller or skill board."""

RELEASING_TEMPLATES: Final[Mapping[str, tuple[str, ...]]] = {
    "goal": ("id",),
    "plan-action": ("goal-id", "plan-id", "id"),
}
"""The deftemplates, with the slots, whose retractions release memory of the tracker."""

MAX_RETIRED: Final = 1000
"""The maximum number of retracted facts, and of messages, in each table; the oldest is dropped."""

Key = TypeVar("Key")
State = TypeVar("State")


NOT_SENT: Final = ("FORMULATED", "PENDING")
"""The states of a plan-action before its message is sent."""

# The slots of goals that are fields of the event; unpacked tuples, because the formatter would write a single
# tuple with one name a line.
_EVENT_SLOTS: Final = (
    *("id", "class", "sub-type", "parent", "mode", "outcome", "error"),
    *("params", "meta", "priority", "required-resources"),
)

_FURTHER_SLOTS: Final = tuple(slot for slot in GOAL_SLOTS if slot.name not in _EVENT_SLOTS)

# In the order in which `track_goal` unpacks the values.
_STATE_SLOTS: Final = ("mode", "outcome", "parent", "error")


class _LastStates(Generic[Key, State]):
    """The last state of each goal or plan-action, by the key in its fact.

    The states of retracted facts are kept for a while, because CLIPS modifies a fact by retracting the fact
    and asserting a new fact.
    """

    def __init__(self) -> None:
        self._states: dict[Key, State] = {}
        # the keys of retracted facts, the oldest first, with whether the retraction is final
        self._retired_keys: dict[Key, bool] = {}
        self.is_first = False
        """Whether the last key had no fact before, or only a finally retracted fact."""

    def __len__(self) -> int:
        return len(self._states) + len(self._retired_keys)

    def update(self, key: Key, state: State) -> bool:
        """Set the state of an asserted fact; return whether the state has changed."""
        self.is_first = self._retired_keys.pop(key, False) or key not in self._states
        if self._states.get(key) == state:
            return False
        self._states[key] = state
        return True

    def retire(self, key: Key, *, is_final: bool = False) -> None:
        """Record the retraction of a fact.

        :param is_final: whether the fact is not asserted again with other slots.
        """
        if key in self._states:
            self._retired_keys.pop(key, None)
            self._retired_keys[key] = is_final
            if len(self._retired_keys) > MAX_RETIRED:
                oldest = next(iter(self._retired_keys))
                del self._retired_keys[oldest], self._states[oldest]


class TransitionTracker:
    """Detects the asserted facts that are transitions.

    Slots have the form that CLIPS prints: strings with or without quotes, the fields of a multislot separated
    by blanks. A fact without the needed slots belongs to a foreign deftemplate and is ignored.

    :param env: the name of the CLIPS environment.
    """

    def __init__(self, env: str) -> None:
        self.env = env
        self._goals: _LastStates[str, tuple[str, ...]] = _LastStates()
        self._actions: _LastStates[tuple[str, str, str], str] = _LastStates()
        self._msgid_by_skill: dict[tuple[str, str], str] = {}  # by skill id and Skiller
        # Skiller and message id, or request on the skill board, by the ids of goal, plan and action
        self._calls: dict[tuple[str, str, str], tuple[str, str]] = {}
        self._last_retracted = ""  # the goal that the last change retracted, else empty

    def __len__(self) -> int:
        """Return the size of the tracker's memory, which grows only with the number of facts.

        The size is the number of remembered states; the state of a retracted fact counts twice.
        """
        return len(self._goals) + len(self._actions)

    def track_assertion(self, time_us: int, template: str, slots: Mapping[str, str]) -> Transition | None:
        """Return the transition that the assertion of a fact causes, or None.

        :param time_us: the run's clock.
        """
        try:
            if template == "goal":
                return self.track_goal(time_us, slots)
            if template == "plan-action":
                return self.track_plan_action(time_us, slots)
            if template == "SkillerInterface":
                return self.read_skiller_status(time_us, slots)
            if template == "skill":
                # the CLIPS Executive for ROS 2 of 2021 has no slot msgid: the id names the message
                _store_newest(
                    self._msgid_by_skill, (slots["id"], _skiller_id(slots)), slots.get("msgid", slots["id"])
                )
            elif template == "skill-action-execinfo":
                skiller = _skiller_id(slots)
                call = self._msgid_by_skill.get((slots["skill-id"], skiller), "0")
                # an action that was not sent has no message
                _store_newest(self._calls, _call_key(slots), ("", "") if call == "0" else (skiller, call))
            elif template == "skill-board-call":
                _store_newest(self._calls, _call_key(slots), ("", slots["id"]))
        except (KeyError, ValueError):
            return None
        return None

    def track_change(self, event: FactChange) -> Transition | None:
        """Return the transition that a printed change of a fact causes, or None.

        :raises FactSyntaxError: if the fact of a goal, plan-action or Skiller cannot be parsed.
        """
        retracted_goal, self._last_retracted = self._last_retracted, ""
        if event.asserted and event.template in TRACKED_TEMPLATES:
            _template, slots = parse_fact(event.text)
            if retracted_goal and (event.template != "goal" or slots.get("id") != retracted_goal):
                # not a `modify`, which would assert a fact of the same goal next
                self._goals.retire(retracted_goal, is_final=True)
            return self.track_assertion(event.time_us, event.template, slots)
        if retracted_goal:
            self._goals.retire(retracted_goal, is_final=True)
        if event.asserted and event.template in CALL_TEMPLATES:
            # facts of the calls only add the link to a message; an invalid fact adds no link
            with suppress(FactSyntaxError):
                self.track_assertion(event.time_us, *parse_fact(event.text))
        elif not event.asserted and event.template in RELEASING_TEMPLATES:
            _template, slots = parse_fact(event.text)
            self.record_retraction(event.template, slots)
            self._last_retracted = slots.get("id", "") if event.template == "goal" else ""
        return None

    def record_retraction(self, template: str, slots: Mapping[str, str], *, is_final: bool = False) -> None:
        """Record the retraction of a fact of `RELEASING_TEMPLATES`, whose state is dropped later.

        :param is_final: whether no ``modify`` asserts the goal again with other slots.
        """
        with suppress(KeyError):  # a foreign deftemplate
            if template == "goal":
                self._goals.retire(slots["id"], is_final=is_final)
            elif template == "plan-action":
                self._actions.retire(_action_key(slots))

    def track_goal(self, time_us: int, slots: Mapping[str, str]) -> GoalTransition | None:
        """Return a transition if mode, outcome, parent or error of the goal changed.

        :raises KeyError: if a slot is missing.
        """
        goal = slots["id"]
        mode, outcome, parent, error = state = tuple(slots[name] for name in _STATE_SLOTS)
        goal_class, sub_type = slots["class"], slots["sub-type"]
        if not self._goals.update(goal, state):
            return None
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
            params=_format_slot(slots, "params"),
            meta=_format_slot(slots, "meta"),
            priority=slots.get("priority", ""),
            resources=_format_slot(slots, "required-resources"),
            # a rule may retract a goal and assert it in its next mode, without making a new goal
            is_new=self._goals.is_first and mode == "FORMULATED" and goal != NO_PARENT,
            slots={
                slot.name: slots[slot.name]
                for slot in _FURTHER_SLOTS
                if slots.get(slot.name, slot.default) != slot.default
            },
        )

    def track_plan_action(self, time_us: int, slots: Mapping[str, str]) -> PlanActionTransition | None:
        """Return a transition if the state of the plan-action changed.

        :raises KeyError: if a slot is missing.
        """
        key, state, action = _action_key(slots), slots["state"], slots["action-name"]
        if not self._actions.update(key, state):
            return None
        if state in NOT_SENT:
            # the message belongs to an earlier plan-action with these ids, or to an earlier try
            self._calls.pop(key, None)
        skiller, call = self._calls.get(key, ("", ""))
        goal, plan, action_id = key
        return PlanActionTransition(
            time_us=time_us,
            env=self.env,
            action_id=action_id,
            goal=goal,
            plan=plan,
            action=action,
            state=state,
            params=_format_slot(slots, "param-values"),
            skiller=skiller,
            call=call,
        )

    def read_skiller_status(self, time_us: int, slots: Mapping[str, str]) -> SkillStatus:
        """Return the status in a SkillerInterface fact.

        :raises KeyError: if a slot is missing.
        :raises ValueError: if the message id is not a number.
        """
        return SkillStatus(
            time_us=time_us,
            env=self.env,
            skiller=unquote(slots["id"]),
            skill_string=unquote(slots["skill_string"]),
            msgid=int(slots["msgid"]),
            status=slots["status"],
        )


def _store_newest(table: dict[Key, State], key: Key, value: State) -> None:
    """Store a value as the newest entry of a table and drop the oldest of too many."""
    table.pop(key, None)
    table[key] = value
    if len(table) > MAX_RETIRED:
        del table[next(iter(table))]


def _skiller_id(slots: Mapping[str, str]) -> str:
    """Return the id of the Skiller in a fact, empty if a skill board takes the calls."""
    return unquote(slots.get("skiller", ""))


def _call_key(slots: Mapping[str, str]) -> tuple[str, str, str]:
    return slots["goal-id"], slots["plan-id"], slots["action-id"]


def _action_key(slots: Mapping[str, str]) -> tuple[str, str, str]:
    return slots["goal-id"], slots["plan-id"], slots["id"]


def _format_slot(slots: Mapping[str, str], name: str) -> str:
    """Return a slot in parentheses, empty if the deftemplate lacks it."""
    value = slots.get(name)
    return "" if value is None else f"({value})"


def unquote(text: str) -> str:
    """Return the content of a string in quotes, or any other text unchanged."""
    # CLIPS 6.30 does not escape quotes within printed strings, so only the outer pair is removed
    return text[1:-1] if len(text) > 1 and text[0] == text[-1] == '"' else text
