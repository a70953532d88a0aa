"""The call stack of a stop: the rule, its plan-action, the goal, and the goal's parents."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Final

from cxbridge.clipstext.facts import FactSyntaxError, parse_fact
from cxbridge.events import FactChange, GoalTransition, PlanActionTransition
from cxbridge.history.forest import Forest, parent_id
from cxbridge.history.tree import goal_title
from cxbridge_studio.dap.bindings import indices_in
from cxbridge_studio.dap.target import FileLine, StoppedEnvironment
from cxbridge_studio.debugger.breakpoints import describe

GOAL: Final = "goal"
ACTION: Final = "plan-action"


@dataclass(frozen=True, slots=True)
class CallFrame:
    """A frame of the stack.

    :param kind: ``rule``, ``plan-action``, ``goal`` or ``event``.
    :param place: the source position; None without a file.
    :param fact: the fact of the goal or plan-action.
    """

    kind: str
    name: str
    place: FileLine | None = None
    fact: FactChange | None = None


def slots_of(fact: FactChange) -> Mapping[str, str]:
    """Return the slots of a fact, as CLIPS prints the values; empty for an ordered fact."""
    with suppress(FactSyntaxError):
        return parse_fact(fact.text)[1]
    return {}


def frames_of(moment: StoppedEnvironment) -> list[CallFrame]:
    """Return the stack, innermost frame first."""
    return [*_rule_frame(moment), *_goal_frames(moment)] or [CallFrame("event", "between two loops")]


def _rule_frame(moment: StoppedEnvironment) -> Iterator[CallFrame]:
    firing = moment.firing
    if firing is None:
        if moment.event is not None:
            yield CallFrame("event", describe(moment.event))
        return
    place = moment.place(firing.rule)
    if place is not None and firing.line:
        place = FileLine(place.file, firing.line, place.text)
    yield CallFrame("rule", firing.rule, place)


def _goal_frames(moment: StoppedEnvironment) -> Iterator[CallFrame]:
    """Yield the frames of the plan-action, the goal and its parents, if known."""
    goals, forest = goals_of(moment)
    action, goal = _subject(moment)
    if action is not None:
        slots = slots_of(action)
        text = " ".join((slots.get("action-name", ""), *slots.get("param-values", "").split()))
        yield CallFrame(ACTION, f"action {text}: {slots.get('state', '')}", fact=action)
    goal_id = goal if goal in goals else None
    while goal_id is not None:
        slots = slots_of(goals[goal_id])
        outcome = slots.get("outcome", "UNKNOWN")
        state = slots.get("mode", "") + (f" {outcome}" if outcome != "UNKNOWN" else "")
        title = goal_title(goal_id, slots.get("class", ""))
        yield CallFrame(GOAL, f"goal {title}: {state}", fact=goals[goal_id])
        goal_id = forest.parents[goal_id]


def goals_of(moment: StoppedEnvironment) -> tuple[dict[str, FactChange], Forest[str]]:
    """Return the facts of the goals by goal id, and the goals as trees."""
    goals = {slots_of(fact).get("id", ""): fact for fact in moment.facts(GOAL)}
    return goals, Forest({name: parent_id(slots_of(fact).get("parent", "")) for name, fact in goals.items()})


def _subject(moment: StoppedEnvironment) -> tuple[FactChange | None, str]:
    """Return the plan-action and the goal id that a stop concerns."""
    event = moment.event
    if isinstance(event, GoalTransition):
        return None, event.goal
    if isinstance(event, PlanActionTransition):
        key = event.goal, event.plan, event.action_id
        return _plan_action(moment, key), event.goal
    basis = () if moment.firing is None else indices_in(moment.firing.basis)
    facts = [fact for fact in map(moment.fact, basis) if fact is not None]
    action = next((fact for fact in facts if fact.template == ACTION), None)
    if action is not None:
        key = goal_id, _, _ = _key_of(action)
        # The rule may have modified the fact since it fired.
        return _plan_action(moment, key) or action, goal_id
    # A rule often matches a goal and its parent: the rule acts on the deepest, so sub-goals come first.
    ids = [slots_of(fact).get("id", "") for fact in facts if fact.template == GOAL]
    parents = {slots_of(fact).get("id", ""): slots_of(fact).get("parent", "") for fact in moment.facts(GOAL)}
    ids.sort(key=lambda goal_id: parents.get(goal_id) not in ids)
    other_ids = [slots_of(fact).get("goal-id", "") for fact in facts]
    return None, next(filter(None, (*ids, *other_ids)), "")


def _plan_action(moment: StoppedEnvironment, key: tuple[str, str, str]) -> FactChange | None:
    return next((fact for fact in moment.facts(ACTION) if _key_of(fact) == key), None)


def _key_of(action: FactChange) -> tuple[str, str, str]:
    slots = slots_of(action)
    return slots.get("goal-id", ""), slots.get("plan-id", ""), slots.get("id", "")
