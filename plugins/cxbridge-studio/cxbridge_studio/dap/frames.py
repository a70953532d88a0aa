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
from cxbridge_studio.dap.agent import FileLine, StoppedEnvironment
from cxbridge_studio.dap.bindings import parse_basis
from cxbridge_studio.debugger.breakpoints import describe_transition

GOAL: Final = "goal"
ACTION: Final = "plan-action"


@dataclass(frozen=True, slots=True)
class CallFrame:
    """A frame of the stack.

    :param kind: ``rule``, ``plan-action``, ``goal`` or ``event``.
    :param name: the name of the rule, or a description, as the client shows it.
    :param position: the position in a file; None if the file is unknown.
    :param fact: the fact of the goal or plan-action; None for other kinds.
    """

    kind: str
    name: str
    position: FileLine | None = None
    fact: FactChange | None = None


def read_slots(fact: FactChange) -> Mapping[str, str]:
    """Return the slots of a fact, as CLIPS prints the values; empty for an ordered fact."""
    with suppress(FactSyntaxError):
        return parse_fact(fact.text)[1]
    return {}


def make_frames(stopped_env: StoppedEnvironment) -> list[CallFrame]:
    """Return the stack, innermost frame first."""
    frames = [*_make_innermost_frames(stopped_env), *_make_goal_frames(stopped_env)]
    return frames or [CallFrame("event", "between two loops")]


def _make_innermost_frames(stopped_env: StoppedEnvironment) -> list[CallFrame]:
    """Return the frame of the rule, or of the transition between two rules; none if there is neither."""
    firing, event = stopped_env.firing, stopped_env.event
    if firing is None:
        return [] if event is None else [CallFrame("event", describe_transition(event))]
    position = stopped_env.agent.find_rule_position(firing.rule)
    if position is not None and firing.line:
        position = FileLine(position.file, firing.line)
    return [CallFrame("rule", firing.rule, position)]


def _make_goal_frames(stopped_env: StoppedEnvironment) -> Iterator[CallFrame]:
    """Yield the frames of the plan-action, the goal and its parents, if known."""
    goals, forest = find_goals(stopped_env)
    action, subject_goal_id = _find_subject(stopped_env, forest)
    if action is not None:
        slots = read_slots(action)
        text = " ".join((slots.get("action-name", ""), *slots.get("param-values", "").split()))
        yield CallFrame(ACTION, f"action {text}: {slots.get('state', '')}", fact=action)
    goal_id = subject_goal_id if subject_goal_id in goals else None
    while goal_id is not None:
        slots = read_slots(goals[goal_id])
        outcome = slots.get("outcome", "UNKNOWN")
        state = slots.get("mode", "") + (f" {outcome}" if outcome != "UNKNOWN" else "")
        title = goal_title(goal_id, slots.get("class", ""))
        yield CallFrame(GOAL, f"goal {title}: {state}", fact=goals[goal_id])
        goal_id = forest.parents[goal_id]


def find_goals(stopped_env: StoppedEnvironment) -> tuple[dict[str, FactChange], Forest[str]]:
    """Return the facts of the goals by goal id, and the goals as trees."""
    goals = {read_slots(fact).get("id", ""): fact for fact in stopped_env.read_facts(GOAL)}
    return goals, Forest(
        {goal_id: parent_id(read_slots(fact).get("parent", "")) for goal_id, fact in goals.items()}
    )


def _find_subject(stopped_env: StoppedEnvironment, forest: Forest[str]) -> tuple[FactChange | None, str]:
    """Return the plan-action and the goal id that a stop concerns; None and empty if there is none."""
    event = stopped_env.event
    if isinstance(event, GoalTransition):
        return None, event.goal
    if isinstance(event, PlanActionTransition):
        key = event.goal, event.plan, event.action_id
        return _find_plan_action(stopped_env, key), event.goal
    indices = () if stopped_env.firing is None else parse_basis(stopped_env.firing.basis)
    facts = [fact for fact in map(stopped_env.find_fact, indices) if fact is not None]
    action = next((fact for fact in facts if fact.template == ACTION), None)
    if action is not None:
        key = goal_id, _, _ = _read_plan_action_key(action)
        # the rule may have modified the fact since the firing
        return _find_plan_action(stopped_env, key) or action, goal_id
    # A rule often matches a goal and its parent, and then acts on the goal: sub-goals come first. Not sort(),
    # which empties the list while the keys are computed.
    ids = [read_slots(fact).get("id", "") for fact in facts if fact.template == GOAL]
    sub_goals_first = sorted(ids, key=lambda goal_id: forest.parents.get(goal_id) not in ids)
    other_ids = [read_slots(fact).get("goal-id", "") for fact in facts]
    return None, next(filter(None, (*sub_goals_first, *other_ids)), "")


def _find_plan_action(stopped_env: StoppedEnvironment, key: tuple[str, str, str]) -> FactChange | None:
    return next((fact for fact in stopped_env.read_facts(ACTION) if _read_plan_action_key(fact) == key), None)


def _read_plan_action_key(action: FactChange) -> tuple[str, str, str]:
    slots = read_slots(action)
    return slots.get("goal-id", ""), slots.get("plan-id", ""), slots.get("id", "")
