"""Builds the history of a run from its events in recorded order: goals, plan-actions, skills, planner calls.

An id may be reused: a goal that is formulated again after its retraction is a new life, and a retried goal
has new plan-actions with the ids of the former plan-actions. Skills come from the executive's reads of a
Skiller, from writes of its interface, or from the messages of a skill board; each skill counts once.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, fields
from typing import Any, Final, Self, TypeVar

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clock import MICROSECONDS
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    PlanActionTransition,
    PlannerCall,
    SkillStatus,
)
from cxbridge.history.exchange import BoardExecutions
from cxbridge.history.model import (
    PLAN_ACTION,
    SKILL_ENDED,
    SKILL_IDLE,
    SKILL_RUNNING,
    ActionAssignment,
    ActionChange,
    ActionKey,
    GoalChange,
    GoalRecord,
    Moment,
    PlanActionRecord,
    PlannerExecution,
    SentCall,
    SkillExecution,
    read_assignment,
    split_fields,
)
from cxbridge.history.monotonic import MonotonicClock
from cxbridge.history.plan_steps import parse_plan_text
from cxbridge.history.transitions import unquote
from cxbridge.history.truncation import MAX_TEXT_CHARACTERS, truncate
from cxbridge.printing import format_count

_SKILLER: Final = "SkillerInterface"
_STARTED: Final = "started"

_Change = TypeVar("_Change", GoalChange, ActionChange)


@dataclass(frozen=True, slots=True)
class HistoryLimits:
    """The limits of a history, which omits the events beyond them.

    The default limits bound the memory of long runs; their numbers are chosen freely.

    :param max_goals: the maximum number of goals.
    :param max_actions: the maximum number of plan-actions.
    :param max_calls: the maximum number of calls of skills, and of planners.
    :param max_transitions: the maximum number of transitions of goals and plan-actions; beyond this
        number a transition replaces the last one of its goal or plan-action, but never the first.
    :param max_text_length: the maximum number of characters of a goal's error, a skill string, or the text
        of a call of a planner.
    """

    max_goals: int = 10_000
    max_actions: int = 30_000
    max_calls: int = 10_000
    max_transitions: int = 300_000
    max_text_length: int = MAX_TEXT_CHARACTERS


UNLIMITED: Final = HistoryLimits(*[sys.maxsize] * len(fields(HistoryLimits)))
"""Limits that no run reaches."""


class RunHistory:
    """The history of a run, built as a sink of an event bus, and readable between two events.

    :param start_us: the start of the run; None: its first event.
    :ivar event_count: the number of events so far.
    :ivar goals: the goals in the order of their first event.
    :ivar actions: the plan-actions in the order of their first event.
    :ivar planner_calls: the calls of planners in the order of their start.
    """

    def __init__(self, limits: HistoryLimits | None = None, start_us: int | None = None) -> None:
        self.clock = MonotonicClock(start_us)
        self.event_count = 0
        self.goals: list[GoalRecord] = []
        self.actions: list[PlanActionRecord] = []
        self.planner_calls: list[PlannerExecution] = []
        self._limits = limits or HistoryLimits()
        # the last life of each goal and plan-action, by environment and id
        self._last_goals: dict[tuple[str, str], GoalRecord] = {}
        self._last_actions: dict[tuple[str, ActionKey], PlanActionRecord] = {}
        self._assignments: dict[tuple[str, ActionKey], ActionAssignment] = {}
        self._skiller_calls: list[SkillExecution] = []
        # by environment and Skiller; None: the Skiller has executed no skill in this run
        self._last_calls: dict[tuple[str, str], SkillExecution | None] = {}
        self._read_skillers: set[str] = set()  # Skillers that an executive reads
        self._board_executions = BoardExecutions(self._limits.max_calls)
        self._open_planner_calls: dict[tuple[str, str], PlannerExecution] = {}
        self._errors_by_skiller: dict[str, str] = {}  # the last text by Skiller, in a team by AGENT/SKILLER
        self._transition_count = 0
        self._handlers: Mapping[type[Event], Callable[[Any], None]] = {
            GoalTransition: self._handle_goal,
            PlanActionTransition: self._handle_action,
            SkillStatus: self._handle_skill,
            FactChange: self._handle_fact,
            InterfaceWrite: self._handle_write,
            InterfaceMessage: lambda event: self._board_executions.record_message(event, self._moment),
            PlannerCall: self._handle_planner_call,
        }

    @classmethod
    def from_events(
        cls, events: Iterable[Event], limits: HistoryLimits | None = None, start_us: int | None = None
    ) -> Self:
        """Build the history of all events."""
        history = cls(limits, start_us)
        for event in events:
            history.record_event(event)
        return history

    def record_event(self, event: Event) -> None:
        """Process the next event."""
        self.clock.advance_to(event.time_us)
        handler = self._handlers.get(type(event))
        if handler is not None:
            handler(event)
        self.event_count += 1

    @property
    def end(self) -> int:
        """The time of the last event, in microseconds since the start of the run."""
        return self.clock.now_us

    @property
    def calls(self) -> list[SkillExecution]:
        """The executed skills in order."""
        # a Skiller and the skill board that serves this Skiller report the same skills, which must count once
        has_skiller_calls = bool(self._skiller_calls) and (
            bool(self._read_skillers) or not self._board_executions.calls
        )
        return self._skiller_calls if has_skiller_calls else self._board_executions.calls

    @property
    def _moment(self) -> Moment:
        return Moment(self.event_count, self.clock.now_us)

    def _handle_goal(self, event: GoalTransition) -> None:
        if event.is_unnamed:
            return
        key = event.env, event.goal
        former_goal = self._last_goals.get(key)
        goal = None if event.is_new else former_goal  # a new goal may reuse an id
        if goal is None:
            if len(self.goals) >= self._limits.max_goals:
                return
            if former_goal is not None:
                former_goal.replaced_seq = self.event_count
            goal = GoalRecord(
                len(self.goals),
                event.env,
                event.goal,
                event.goal_class,
                event.sub_type,
                life=1 if former_goal is None else former_goal.life + 1,
            )
            self._last_goals[key] = goal
            self.goals.append(goal)
        goal.goal_class, goal.sub_type = event.goal_class, event.sub_type
        self._append_change(
            goal.changes,
            GoalChange(
                *self._moment,
                event.mode,
                event.outcome,
                truncate(event.error, self._limits.max_text_length),
                event.parent,
            ),
        )

    def _handle_action(self, event: PlanActionTransition) -> None:
        key = event.env, (event.goal, event.plan, event.action_id)
        action, goal = self._last_actions.get(key), self._last_goals.get((event.env, event.goal))
        if action is None or self._is_new_action(action, goal, event):
            if len(self.actions) >= self._limits.max_actions:
                return
            action = PlanActionRecord(
                len(self.actions), event.env, event.goal, goal, event.plan, event.action_id, event.action
            )
            action.params = event.params
            assignment = self._assignments.get(key, ActionAssignment())
            # the assignment may belong to the previous plan-action with these ids
            event_arguments = split_fields(event.params[1:-1])  # without parentheses
            action.assignment = ActionAssignment(assignment.skiller, event_arguments or assignment.arguments)
            self._last_actions[key] = action
            self.actions.append(action)
            if goal is not None:
                goal.actions.append(action)
        sent_call = SentCall(self.event_count, event.skiller, event.call)
        # later transitions repeat the message
        if event.call and (
            not action.sent_calls or action.sent_calls[-1]._replace(seq=sent_call.seq) != sent_call
        ):
            action.sent_calls.append(sent_call)
        self._append_change(action.changes, ActionChange(*self._moment, event.state))

    @staticmethod
    def _is_new_action(
        action: PlanActionRecord, goal: GoalRecord | None, event: PlanActionTransition
    ) -> bool:
        """Return whether an event belongs to a new plan-action that reuses ids after a retry of its goal."""
        # empty parameters are unknown, because the run was recorded without parameters
        has_other_params = bool(action.params and event.params) and action.params != event.params
        has_other_goal = action.goal_record is not None and action.goal_record is not goal
        return has_other_goal or has_other_params or action.name != event.action

    def _append_change(self, changes: list[_Change], change: _Change) -> None:
        """Append a change. Beyond the limit, replace the last change, so that start and end are correct."""
        if self._transition_count < self._limits.max_transitions or len(changes) <= 1:
            self._transition_count += 1
            changes.append(change)
        else:
            changes[-1] = change

    def _handle_skill(self, event: SkillStatus) -> None:
        key = event.env, event.skiller
        if event.skiller not in self._read_skillers:
            self._read_skillers.add(event.skiller)
            # a write on a single agent's blackboard names no environment: the first read moves its call to
            # the environment
            call = self._last_calls.pop(("", event.skiller), None)
            if call is not None and key not in self._last_calls:
                call.env = event.env
                # a skill that still runs begins at the read, like the skills of later reads
                if call.end is None:
                    call.begin = self._moment
                self._last_calls[key] = call
        self._record_status(key, event)

    def _record_status(self, key: tuple[str, str], event: SkillStatus) -> None:
        """End, continue or start a call, depending on the Skiller's last call.

        :param key: environment and Skiller.
        """
        skill_string, moment = truncate(event.skill_string, self._limits.max_text_length), self._moment
        if key not in self._last_calls and event.status in SKILL_ENDED:
            self._last_calls[key] = SkillExecution(
                *key, skill_string, event.msgid, moment, moment, event.status
            )
            return  # a Skiller that was used before this run still shows its last skill: no call of this run
        call = self._last_calls.setdefault(key, None)
        is_last_call = call is not None and (call.skill_string, call.msgid) == (skill_string, event.msgid)
        if call is not None and call.end is None and (not is_last_call or event.status != SKILL_RUNNING):
            # the skill has ended; or the Skiller shows another skill or none, because the skill was stopped
            # before it reported an end
            call.end = moment
            call.status = event.status if is_last_call and event.status != SKILL_IDLE else "stopped"
            if call.status in SKILL_ENDED:
                call.error = self._find_error_text(*key)
            if is_last_call:
                return
        if event.status == SKILL_RUNNING and not (is_last_call and call is not None and call.end is None):
            self._register_call(
                key, SkillExecution(*key, skill_string, event.msgid, moment, None, SKILL_RUNNING)
            )
        elif event.status in SKILL_ENDED and skill_string and not is_last_call:
            # started and ended between two reads of the executive
            error = self._find_error_text(*key)
            self._register_call(
                key, SkillExecution(*key, skill_string, event.msgid, moment, moment, event.status, error)
            )

    def _register_call(self, key: tuple[str, str], call: SkillExecution) -> None:
        """Register a call as the last call of its Skiller."""
        self._last_calls[key] = call
        if len(self._skiller_calls) < self._limits.max_calls:
            self._skiller_calls.append(call)

    def _handle_write(self, event: InterfaceWrite) -> None:
        interface_type, _, name = event.uid.partition("::")
        if interface_type != _SKILLER:
            return
        values, skiller = event.values, name.rpartition("/")[2]
        self._record_error(name, str(values.get("error", "")))
        # a Skiller that an executive reads is counted at the read, one cycle later, as its plan-actions are
        msgid = values.get("msgid")  # of any type: a recording may come from another program
        if (
            skiller not in self._read_skillers
            and isinstance(msgid, int)
            and {"skill_string", "status"} <= values.keys()
        ):
            # a running program has an enum item, a recording its name
            status = getattr(values["status"], "name", str(values["status"]))
            env = name.rpartition("/")[0]
            self._record_status(
                (env, skiller),
                SkillStatus(event.time_us, env, skiller, str(values["skill_string"]), msgid, status),
            )

    def _find_error_text(self, env: str, skiller: str) -> str:
        # each of several agents has its own blackboard, whose name precedes the Skiller's
        return self._errors_by_skiller.get(f"{env}/{skiller}") or self._errors_by_skiller.get(skiller, "")

    def _record_error(self, skiller: str, text: str) -> None:
        """Record a Skiller's error text, which may follow the end of the skill at the same time."""
        self._errors_by_skiller[skiller] = text
        for (env, name), call in self._last_calls.items():
            has_ended_now = call is not None and call.end is not None and call.end.time == self.end
            if call is not None and has_ended_now and skiller in (name, f"{env}/{name}") and not call.error:
                call.error = text

    def _handle_fact(self, event: FactChange) -> None:
        if event.asserted and event.template == PLAN_ACTION:
            with suppress(FactSyntaxError):  # a recording may contain any text
                _template, slots = parse_fact(event.text)
                self._record_assignment(event.env, *read_assignment(slots))
        elif event.asserted and event.template == _SKILLER:
            with suppress(FactSyntaxError):  # a recording may contain any text
                _template, slots = parse_fact(event.text)
                self._record_error(unquote(slots.get("id", "")), unquote(slots.get("error", "")))

    def _record_assignment(self, env: str, key: ActionKey, assignment: ActionAssignment) -> None:
        if len(self._assignments) < self._limits.max_actions:
            self._assignments[env, key] = assignment
            # the event of the action has no arguments if the run was recorded without parameters
            if (action := self._last_actions.get((env, key))) is not None and not action.params:
                action.assignment = assignment

    def _handle_planner_call(self, event: PlannerCall) -> None:
        key, max_length = (event.env, event.call), self._limits.max_text_length
        call = self._open_planner_calls.pop(key, None)
        if call is None:
            call = PlannerExecution(
                event.planner, event.goal, self._moment, text=truncate(event.problem, max_length)
            )
            if len(self.planner_calls) < self._limits.max_calls:
                self.planner_calls.append(call)
        if event.status == _STARTED:
            self._open_planner_calls[key] = call
        else:
            call.end, call.status = self._moment, event.status
            duration_text = f"{event.duration_us / MICROSECONDS:.3f} s of real time"
            outcome = format_count(event.actions, "action") if event.status == "found" else event.reason
            call.text = truncate(f"{outcome}, {duration_text}: {event.problem}", max_length)
            self._record_plan_arguments(event)

    def _record_plan_arguments(self, event: PlannerCall) -> None:
        """Record the arguments of a plan's actions."""
        # planning features name the plan like the call
        with suppress(ValueError):  # a recording may contain any text
            for number, step in enumerate(parse_plan_text(event.plan)[: self._limits.max_actions], start=1):
                key = event.goal, event.call, str(number)
                if (event.env, key) not in self._assignments:
                    self._record_assignment(event.env, key, ActionAssignment(arguments=step.arguments))
