"""Partial order of transitions: what depends on what must be in the same order, nothing else.

docs/comparing.md, section "Partial order", is the definition that this module implements.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cxbridge.event_kinds import View
from cxbridge.trace.compare.checks import Tolerance
from cxbridge.trace.compare.goals import Goal, GoalForest, GoalKey, plans_by_stem
from cxbridge.trace.compare.matching import Match, match_goals
from cxbridge.trace.compare.naming import anonymous
from cxbridge.trace.compare.relations import Relations
from cxbridge.trace.compare.result import MAX_DIFFERENCES, Comparison, Difference, Kind, Order, Side
from cxbridge.trace.compare.steps import Differing, State, StepPair, Steps
from cxbridge.trace.compare.words import judge
from cxbridge.trace.formats.base import Run


def compare_partial(a: Run, others: Sequence[Run], tolerance: Tolerance | None = None) -> Comparison:
    """Compare the transitions of a run with those of others.

    With several others, the run must have the same goals, plans, statuses as each of them; of the relations
    between a goal and its parent only those count that all the others agree on.
    """
    forest_a = GoalForest(a)
    relations = Relations(several=len(others) > 1)
    for number, run in enumerate(others):
        forest_b = GoalForest(run)
        comparison = Comparison(View.TRANSITIONS, Order.PARTIAL, forest_a.count, forest_b.count, other=number)
        match = match_goals(forest_a, forest_b)
        differing = Differing((forest_a.start_us, forest_b.start_us), tolerance)
        differing.found += _goal_differences(match)
        for pair in (*_step_pairs(match), *forest_a.skillers.pairs(forest_b.skillers)):
            differing.compare(pair)
        if differing.found:
            differing.finish(comparison)
            comparison.hints += judge(forest_a.scopes, forest_b.scopes)
            return comparison
        relations.add(match)
    found = sorted(relations.broken(), key=lambda difference: difference.position)
    comparison.other = 0
    comparison.differences = found[:MAX_DIFFERENCES]
    comparison.dropped = len(found) - len(comparison.differences)
    return comparison


def _goal_differences(match: Match) -> Iterator[Difference]:
    """Yield the goals that are in one run only, or have another parent or class."""
    for goal in match.only_a:
        there = Side(goal.start, _goal_text(goal))
        missing = Side(None, "(no such goal)")
        yield Difference("a goal that only A has", match.labels_a[goal.key], there, missing, Kind.ONLY_A)
    for goal in match.only_b:
        there = Side(goal.start, _goal_text(goal))
        missing = Side(None, "(no such goal)")
        yield Difference("a goal that only B has", match.labels_b[goal.key], missing, there, Kind.ONLY_B)
    for one, other in match.adopted:
        yield _goal_difference("another parent", match, one, other, [_below(goal) for goal in (one, other)])
    for one, other in match.renamed:
        yield _goal_difference(
            "another class or id", match, one, other, [_named(goal) for goal in (one, other)]
        )


def _goal_difference(what: str, match: Match, one: Goal, other: Goal, texts: Sequence[str]) -> Difference:
    """Return a difference between goals that belong together."""
    subject = f"goal {match.labels_a[one.key]}"
    return Difference(what, subject, Side(one.start, texts[0]), Side(other.start, texts[1]))


def _below(goal: Goal) -> str:
    """Return which parent a goal has."""
    return f"goal {goal.key[1]} below {goal.parent[1] if goal.parent else 'no parent'}"


def _named(goal: Goal) -> str:
    """Return what a goal is."""
    return f"goal {goal.key[1]} of class {goal.goal_class}, sub-type {goal.sub_type}"


def _goal_text(goal: Goal) -> str:
    """Return what a goal is that one run has only."""
    below = goal.size - 1
    more = f", with {below} below it" if below else ""
    return f"goal {goal.key[1]} of class {goal.goal_class}{more}"


def _step_pairs(match: Match) -> Iterator[StepPair]:
    """Yield the transitions of all goals and plans, those of partners together."""
    for one, other in match.pairs:
        label = match.labels_a[one.key]
        own_a, own_b = _renamed(one, match.labels_a), _renamed(other, match.labels_b)
        yield StepPair(f"goal {label}", "transition", one.own, other.own, own_a, own_b)
        plans_a, plans_b = plans_by_stem(one), plans_by_stem(other)
        for plan in {**plans_a, **plans_b}:
            steps_a, steps_b = plans_a.get(plan, Steps()), plans_b.get(plan, Steps())
            subject = f"plan {plan.replace('@', one.key[1])} of goal {label}"
            yield StepPair(subject, "transition", steps_a, steps_b, steps_a.states, steps_b.states)


def _renamed(goal: Goal, labels: dict[GoalKey, str]) -> list[State]:
    """Return the states of a goal with the goals in its errors called by their labels."""
    env = goal.key[0]
    return [
        (
            mode,
            outcome,
            error and " ".join(labels.get((env, word)) or anonymous(word) for word in error.split()),
        )
        for mode, outcome, error in goal.own.states
    ]
