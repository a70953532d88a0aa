"""Reads a run once, and keeps of it what a page shows."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from typing import Any

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.clock import MICROSECONDS
from cxbridge.events import (
    Event,
    FactChange,
    GoalTransition,
    InterfaceMessage,
    InterfaceWrite,
    Level,
    LogLine,
    PlanActionTransition,
    PlannerCall,
    RuleFired,
    SkillStatus,
)
from cxbridge.trace.codec import plain_values
from cxbridge.trace.formats.base import Run
from cxbridge.trace.report.executions import Executions
from cxbridge.trace.report.keeping import Kept, cut
from cxbridge.trace.report.model import (
    Action,
    Goal,
    GoalState,
    InterfaceCount,
    Limits,
    RuleCount,
    RunModel,
    SkillCall,
    Span,
)
from cxbridge.trace.report.orders import PLAN_ACTION, Key, Order, order_of
from cxbridge.trace.report.steady import SteadyClock

_STARTED = "started"
_STEP = re.compile(r"\(([^()]*)\)")
IDLE = "S_INACTIVE"
RUNNING = "S_RUNNING"
ENDED = frozenset({"S_FINAL", "S_FAILED"})

FACT_POINTS = 2000
"""How many points the curve of facts has at most."""

LONGEST_VALUE = 400
"""How many characters of a field's value are kept."""


def read(run: Run, limits: Limits | None = None) -> RunModel:
    """Read a run, and return what a page shows of it.

    :raises TraceError: when it cannot be read.
    """
    model = read_events(run, limits)
    model.notes[:0] = run.notes
    return model


def read_events(events: Iterable[Event], limits: Limits | None = None) -> RunModel:
    """Return what a page shows of events."""
    reader = _Reader(limits or Limits())
    for event in events:
        reader.take(event)
    return reader.finish()


class _Reader:
    """Takes events in recorded order."""

    def __init__(self, limits: Limits) -> None:
        self._limits = limits
        self._clock = SteadyClock()
        self._log = {level.value: Kept[tuple[int, int, int, str]](limits.log) for level in Level}
        self._model = RunModel(
            log=self._log,
            firings=Kept(limits.firings),
            changes=Kept(limits.writes),
            messages=Kept(limits.writes),
        )
        self._seq = 0
        self._now = 0
        self._goals: dict[tuple[str, str], Goal] = {}
        self._actions: dict[tuple[str, str, str, str], Action] = {}
        self._orders: dict[tuple[str, Key], Order] = {}
        self._rules: dict[tuple[str, str], int] = {}
        self._calls: dict[tuple[str, str], SkillCall | None] = {}
        self._spans: dict[tuple[str, str], Span] = {}
        self._components: dict[str, int] = {}
        self._interfaces: dict[str, int] = {}
        self._values: dict[str, dict[str, str]] = {}
        self._transitions = 0
        self._more_facts = 0
        self._lost = {"goal": 0, "plan-action": 0, "skill call": 0, "planner call": 0, "transition": 0}
        self._executions = Executions(limits.calls)
        self._curve = _Curve(FACT_POINTS)
        self._takers: Mapping[type[Event], Callable[[Any], None]] = {
            GoalTransition: self._goal,
            PlanActionTransition: self._action,
            SkillStatus: self._skill,
            RuleFired: self._rule,
            FactChange: self._fact,
            LogLine: self._line,
            InterfaceWrite: self._write,
            InterfaceMessage: self._message,
            PlannerCall: self._plan,
        }

    def take(self, event: Event) -> None:
        """Take the next event."""
        self._now = self._clock.at(event.time_us)
        taker = self._takers.get(type(event))
        if taker is not None:
            taker(event)
        self._seq += 1

    def finish(self) -> RunModel:
        """Return what was kept."""
        model = self._model
        model.events, model.end, model.start_us = self._seq, self._now, self._clock.first_us
        model.facts = self._curve.points()
        for action in model.actions:
            key = action.env, (action.goal_id, action.plan, action.action_id)
            action.order = self._orders.get(key, action.order)
        if not model.calls:  # a Skiller that is served by a skill board has told already
            model.calls, self._lost["skill call"] = self._executions.calls, self._executions.lost
        model.notes = [*self._clock.notes(), *self._left_out()]
        return model

    def _goal(self, event: GoalTransition) -> None:
        key = event.env, event.goal
        goal = self._goals.get(key)
        if goal is None:
            if len(self._goals) >= self._limits.goals:
                self._lost["goal"] += 1  # its transitions; counted as such below
                return
            number = len(self._goals)
            goal = Goal(number, event.env, event.goal, event.goal_class, event.sub_type, event.parent)
            self._goals[key] = goal
            self._model.goals.append(goal)
        goal.parent = event.parent
        state = GoalState(self._seq, self._now, event.mode, event.outcome, cut(event.error))
        self._append(goal.states, state)

    def _action(self, event: PlanActionTransition) -> None:
        key = event.env, event.goal, event.plan, event.action_id
        action = self._actions.get(key)
        if action is None:
            if len(self._actions) >= self._limits.actions:
                self._lost["plan-action"] += 1
                return
            goal = self._goals.get((event.env, event.goal))
            action = Action(
                number=len(self._actions),
                env=event.env,
                goal=None if goal is None else goal.number,
                goal_id=event.goal,
                plan=event.plan,
                action_id=event.action_id,
                name=event.action,
            )
            self._actions[key] = action
            self._model.actions.append(action)
        self._append(action.states, (self._seq, self._now, event.state))

    def _append(self, states: list[Any], state: Any) -> None:
        """Add a state; when there are too many, in place of the last one, so that begin and end are right."""
        if self._transitions < self._limits.transitions or len(states) <= 1:
            self._transitions += 1
            states.append(state)
        else:
            self._lost["transition"] += 1
            states[-1] = state

    def _skill(self, event: SkillStatus) -> None:
        key = event.env, event.skiller
        here = self._seq, self._now
        if key not in self._calls and event.status in ENDED:
            self._calls[key] = SkillCall(*key, event.skill_string, event.msgid, here, here, event.status)
            return  # a skiller that was used before this run still shows what it did last
        call = self._calls.setdefault(key, None)
        same = call is not None and (call.skill_string, call.msgid) == (event.skill_string, event.msgid)
        if call is not None and call.end is None and (not same or event.status != RUNNING):
            # the end of this skill, or (another one, or none, is there) it was stopped before it said so
            call.end = here
            call.status = event.status if same and event.status != IDLE else "stopped"
            if call.status in ENDED:
                call.error = self._error_of(event.skiller)
            if same:
                return
        if event.status == RUNNING and not (same and call is not None and call.end is None):
            self._begin(key, SkillCall(*key, cut(event.skill_string), event.msgid, here, None, RUNNING))
        elif event.status in ENDED and event.skill_string and not same:
            # over between two looks of the executive
            status = event.status
            done = SkillCall(*key, cut(event.skill_string), event.msgid, here, here, status)
            done.error = self._error_of(event.skiller)
            self._begin(key, done)

    def _begin(self, key: tuple[str, str], call: SkillCall) -> None:
        """Remember a call as its skiller's last one."""
        self._calls[key] = call
        if len(self._model.calls) < self._limits.calls:
            self._model.calls.append(call)
        else:
            self._lost["skill call"] += 1

    def _error_of(self, skiller: str) -> str:
        """Return the error that a skiller's interface shows."""
        return self._values.get(f"SkillerInterface::{skiller}", {}).get("error", "")

    def _rule(self, event: RuleFired) -> None:
        key = event.env, event.rule
        number = self._rules.get(key)
        here = self._seq, self._now
        if number is None:
            number = self._rules[key] = len(self._rules)
            self._model.rules.append(RuleCount(event.env, event.rule, 0, here, here))
        rule = self._model.rules[number]
        rule.count += 1
        rule.last = here
        self._model.firings.add((*here, number))

    def _fact(self, event: FactChange) -> None:
        self._more_facts += 1 if event.asserted else -1
        self._curve.add(self._seq, self._now, self._more_facts)
        if event.asserted and event.template == PLAN_ACTION and len(self._orders) < self._limits.actions:
            with suppress(FactSyntaxError):
                key, order = order_of(parse_fact(event.text)[1])
                self._orders[event.env, key] = order

    def _line(self, event: LogLine) -> None:
        component = self._components.setdefault(event.component, len(self._components))
        if component == len(self._model.components):
            self._model.components.append(event.component)
        self._log[event.level.value].add((self._seq, self._now, component, cut(event.text)))

    def _write(self, event: InterfaceWrite) -> None:
        number = self._interface(event.uid)
        known = self._values.setdefault(event.uid, {})
        changed = {}
        for name, value in plain_values(event.values).items():
            text = cut(_value_text(value), LONGEST_VALUE)
            if known.get(name) != text:
                known[name] = changed[name] = text
        count = self._model.interfaces[number]
        count.first = count.first if count.writes else self._now
        count.writes += 1
        count.last = self._now
        if changed:
            count.changes += 1
            self._model.changes.add((self._seq, self._now, number, changed))

    def _message(self, event: InterfaceMessage) -> None:
        number = self._interface(event.uid)
        self._model.interfaces[number].messages += 1
        self._executions.take(event, (self._seq, self._now))
        values = " ".join(f"{name}={_value_text(each)}" for name, each in plain_values(event.values).items())
        sender = f" from {event.sender}" if event.sender else ""
        text = f"{event.message} {event.msgid} {event.outcome}{sender}: {values}"
        self._model.messages.add((self._seq, self._now, number, cut(text)))

    def _plan(self, event: PlannerCall) -> None:
        here, key = (self._seq, self._now), (event.env, event.call)
        span = self._spans.pop(key, None)
        if span is None:
            span = Span(event.planner, event.goal, here, text=cut(event.problem))
            if len(self._model.spans) < self._limits.calls:
                self._model.spans.append(span)
            else:
                self._lost["planner call"] += 1
        if event.status == _STARTED:
            self._spans[key] = span
        else:
            span.end, span.status = here, event.status
            took = f"{event.duration_us / MICROSECONDS:.3f} s of real time"
            what = f"{event.actions} actions" if event.status == "found" else event.reason
            span.text = cut(f"{what}, {took}: {event.problem}")
            self._order_steps(event)

    def _order_steps(self, event: PlannerCall) -> None:
        """Note the arguments of a plan's actions: planning features call the plan as the call."""
        for number, step in enumerate(_STEP.findall(event.plan)[: self._limits.actions], start=1):
            key = event.goal, event.call, str(number)
            self._orders.setdefault((event.env, key), Order(arguments=tuple(step.split()[1:])))

    def _interface(self, uid: str) -> int:
        """Return the number of an interface, which may be new."""
        number = self._interfaces.setdefault(uid, len(self._interfaces))
        if number == len(self._model.interfaces):
            self._model.interfaces.append(InterfaceCount(uid))
        return number

    def _left_out(self) -> list[str]:
        """Return what is not on the page."""
        model, told = self._model, []
        for level, lines in self._log.items():
            if lines.lost:
                told.append(_middle(f"log lines of level {level}", lines))
        if model.changes.lost:
            told.append(_middle("interface writes", model.changes))
        if model.messages.lost:
            told.append(_middle("messages", model.messages))
        if model.firings.lost:
            told.append(_middle("firings", model.firings) + " All are counted in the table of rules.")
        told += [
            f"{count} {_LOST[what]}: 'cxbridge trace cat' has them."
            for what, count in self._lost.items()
            if count
        ]
        return told


_LOST = {
    "goal": "transitions of goals beyond the limit of goals are left out",
    "plan-action": "transitions of plan-actions beyond the limit of plan-actions are left out",
    "skill call": "calls of skills beyond the limit are left out",
    "planner call": "calls of planners beyond the limit are left out",
    "transition": "transitions are left out, the first and the last of each goal and plan-action are there",
}


def _middle(what: str, kept: Kept[Any]) -> str:
    """Return that the middle of something is missing."""
    return (
        f"{kept.lost} of {kept.total} {what} are left out, from the middle of the run: "
        "'cxbridge trace cat' has them."
    )


def _value_text(value: object) -> str:
    """Return a field's value as text."""
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value_text(each) for each in value) + "]"
    if isinstance(value, bytes):
        return value.hex()
    return str(value)


class _Curve:
    """A number over time, thinned to a bounded count of points: the last of each stretch of time."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._width = 1
        self._points: dict[int, tuple[int, int, int]] = {}

    def add(self, seq: int, time: int, number: int) -> None:
        """Add a point, not before the last one."""
        self._points[time // self._width] = (seq, time, number)
        while len(self._points) > self._limit:
            self._width *= 2
            self._points = {point[1] // self._width: point for point in self._points.values()}

    def points(self) -> list[tuple[int, int, int]]:
        """Return the points."""
        return list(self._points.values())
