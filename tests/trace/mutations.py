"""Changes of runs: those that a comparison must find, and those that it must not mind."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from random import Random
from typing import Any

from cxbridge.events import Event, GoalTransition, PlanActionTransition, SkillStatus
from cxbridge.transitions import Transition

Mutation = Callable[[list[Transition], Random], list[Transition] | None]
"""Returns a changed copy, None when the event it hit upon cannot be changed in this way."""


def thread(event: Transition) -> tuple[str, ...]:
    """What the event is a step of: a goal, a plan, a skiller."""
    if isinstance(event, GoalTransition):
        return ("goal", event.goal)
    if isinstance(event, PlanActionTransition):
        return ("plan", event.goal, event.plan)
    return ("skiller", event.skiller)


def state(event: Transition) -> tuple[str, ...]:
    """What counts of the event in partial order, within its thread."""
    if isinstance(event, GoalTransition):
        return (event.mode, event.outcome, event.error)
    if isinstance(event, PlanActionTransition):
        return (event.action_id, event.action, event.state)
    return (event.skill_string, event.status)


def _neighbour(events: list[Transition], at: int, step: int) -> int | None:
    """The index of the previous (-1) or next (1) event of the same thread."""
    places = range(at + 1, len(events)) if step > 0 else range(at - 1, -1, -1)
    return next((i for i in places if thread(events[i]) == thread(events[at])), None)


def drop(events: list[Transition], random: Random) -> list[Transition] | None:
    at = random.randrange(len(events))
    around = (_neighbour(events, at, -1), _neighbour(events, at, 1))
    if any(i is not None and state(events[i]) == state(events[at]) for i in around):
        return None  # only the parent changes here
    return events[:at] + events[at + 1 :]


def swap(events: list[Transition], random: Random) -> list[Transition] | None:
    at = random.randrange(len(events))
    other = _neighbour(events, at, 1)
    if other is None or state(events[at]) == state(events[other]):
        return None
    changed = list(events)
    changed[at], changed[other] = changed[other], changed[at]
    return changed


def _altered(kind: type[Event], field: str, values: list[str]) -> Mutation:
    def alter(events: list[Transition], random: Random) -> list[Transition] | None:
        at = random.randrange(len(events))
        value = random.choice(values)
        if not isinstance(events[at], kind) or getattr(events[at], field) == value:
            return None
        changed: dict[str, Any] = {field: value}
        return [*events[:at], replace(events[at], **changed), *events[at + 1 :]]

    alter.__name__ = f"alter_{field}"
    return alter


def orphan(events: list[Transition], random: Random) -> list[Transition] | None:
    """Take a goal from its parent for good."""
    at = random.randrange(len(events))
    goal = events[at]
    if not isinstance(goal, GoalTransition) or goal.parent == "nil" or _neighbour(events, at, 1) is not None:
        return None
    return [*events[:at], replace(goal, parent="nil"), *events[at + 1 :]]


MUTATIONS: list[Mutation] = [
    drop,
    swap,
    orphan,
    _altered(GoalTransition, "mode", ["FORMULATED", "SELECTED", "EXPANDED", "FINISHED", "ODD"]),
    _altered(GoalTransition, "outcome", ["COMPLETED", "FAILED", "REJECTED"]),
    _altered(GoalTransition, "error", ["ODD", "SUB-GOAL-FAILED gen8"]),
    _altered(PlanActionTransition, "state", ["PENDING", "RUNNING", "FINAL", "EXECUTION-FAILED"]),
    _altered(PlanActionTransition, "action", ["odd"]),
    _altered(PlanActionTransition, "action_id", ["15"]),
    _altered(SkillStatus, "skill_string", ["", 'say{text="odd"}']),
    _altered(SkillStatus, "status", ["S_INACTIVE", "S_FAILED"]),
]


def renumber(events: list[Transition], random: Random) -> list[Transition]:
    """Give every gensym id another number, and every event another time."""
    numbers = random.sample(range(1, 100_000), 200)
    names: dict[str, str] = {}

    def rename(match: re.Match[str]) -> str:
        return names.setdefault(match.group(), f"gen{numbers[len(names)]}")

    changed: list[Transition] = []
    time_us = random.randrange(10**15)
    for event in events:
        time_us += random.randrange(1_000_000)
        texts: dict[str, Any] = {
            name: re.sub(r"\bgen\d+\b", rename, value)
            for name in ("goal", "parent", "error", "plan")
            if (value := getattr(event, name, None)) is not None
        }
        changed.append(replace(event, time_us=time_us, **texts))
    return changed


def shuffle(events: list[Transition], random: Random, steps: int = 3000) -> list[Transition]:
    """Exchange neighbours that do not depend on each other, many times."""
    parents = {event.goal: event.parent for event in events if isinstance(event, GoalTransition)}
    changed = list(events)
    for _ in range(steps):
        at = random.randrange(len(changed) - 1)
        if _independent(changed[at], changed[at + 1], parents):
            changed[at], changed[at + 1] = changed[at + 1], changed[at]
    return changed


def _independent(one: Transition, other: Transition, parents: dict[str, str]) -> bool:
    goals = [getattr(event, "goal", "") for event in (one, other)]
    if goals[0] == goals[1] or parents.get(goals[0]) == goals[1] or parents.get(goals[1]) == goals[0]:
        return False
    return thread(one) != thread(other)
