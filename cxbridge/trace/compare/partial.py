"""Comparison in partial order: only dependent events must have the same order.

The goals of both runs are paired by their structure, and the transitions of each pair are compared in order.
Then the order between a goal and its plans and sub-goals is compared, as far as all other runs agree on that
order. docs/comparing.md, section "Partial order", has the definition.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import chain

from cxbridge.trace.compare.goal_matching import GoalMatch
from cxbridge.trace.compare.goals import GOAL_ITSELF, Goal, GoalForest, GoalKey, Steps
from cxbridge.trace.compare.model import Difference, DifferenceKind, Side
from cxbridge.trace.compare.names import replace_names
from cxbridge.trace.compare.sequences import ONE_SIDED_KINDS, compare_sequences
from cxbridge.trace.compare.steps import Step


def compare_goals(match: GoalMatch, tolerance_s: float | None = None) -> Iterator[Difference]:
    """Yield the differences between the goals, plans, Skillers and interfaces of two runs.

    :param tolerance_s: the allowed difference between times in seconds; None: times are not compared.
    """
    for run, kind in enumerate(ONE_SIDED_KINDS):
        for goal in match.unmatched_goals[run]:
            side, missing_side = Side(goal.first_position, _describe_goal(goal)), Side(None, "(no such goal)")
            sides = (missing_side, side) if run else (side, missing_side)
            yield Difference(f"a goal that only {'AB'[run]} has", match.labels[goal], *sides, kind)
    for subject, steps_a, steps_b in chain(_pair_threads(match), _pair_streams(*match.forests)):
        # most sequences are equal
        if tolerance_s is not None or [step.key for step in steps_a] != [step.key for step in steps_b]:
            yield from compare_sequences(steps_a, steps_b, subject, tolerance_s=tolerance_s)
    for subject, details_a, details_b in _pair_details(match):
        yield from compare_sequences(details_a, details_b, subject)


def _describe_goal(goal: Goal) -> str:
    subtree = f", with {goal.goal_count - 1} below it" if goal.goal_count > 1 else ""
    parent = f" below {goal.parent.id}" if goal.parent else ""
    return f"goal {goal.key.id} of class {goal.goal_class}, sub-type {goal.sub_type}{parent}{subtree}"


def _pair_streams(a: GoalForest, b: GoalForest) -> Iterator[tuple[str, Steps, Steps]]:
    """Yield each Skiller or interface with its steps in both runs."""
    for subject in {**a.streams, **b.streams}:
        yield subject, a.streams.get(subject, ()), b.streams.get(subject, ())


def _pair_threads(match: GoalMatch) -> Iterator[tuple[str, Steps, Steps]]:
    """Yield each paired goal, and each plan of such a goal, with its transitions in both runs."""
    for goals in match.pairs:
        for plan in goals[0].threads | goals[1].threads:
            steps_a, steps_b = (
                goal.threads.get(plan, ()) if plan else _label_errors(goal, forest, match)
                for goal, forest in zip(goals, match.forests, strict=True)
            )
            yield _describe_thread(match, goals[0], plan), steps_a, steps_b


def _pair_details(match: GoalMatch) -> Iterator[tuple[str, Steps, Steps]]:
    """Yield each paired goal, and each plan that both goals have, with its details in both runs."""
    for goal_a, goal_b in match.pairs:
        # an action that only one run has is a difference of the plan already, and details that only one run
        # has are not compared
        for plan in [plan for plan in goal_a.details if plan in goal_b.details]:
            details = goal_a.details[plan], goal_b.details[plan]
            owners = {step.thread for step in details[0]} & {step.thread for step in details[1]}
            details_a, details_b = ([step for step in steps if step.thread in owners] for steps in details)
            yield f"details of {_describe_thread(match, goal_a, plan)}", details_a, details_b


def _describe_thread(match: GoalMatch, goal: Goal, plan: str) -> str:
    """Return a goal, or a plan of the goal, for differences."""
    subject = f"goal {match.labels[goal]}"
    return f"plan {plan.replace('@', goal.key.id)} of {subject}" if plan else subject


def _label_errors(goal: Goal, forest: GoalForest, match: GoalMatch) -> Steps:
    """Return the steps of a goal with labels instead of the ids of goals in its errors."""

    def label(word: str) -> str:
        named_goal = forest.goals.get(GoalKey(goal.key.env, word))
        return match.labels.get(named_goal, replace_names(word)) if named_goal else replace_names(word)

    steps = [*goal.transitions]
    for number, error in goal.errors.items():
        labelled_error = " ".join(map(label, error.split()))
        steps[number] = steps[number]._replace(key=(*steps[number].key[:-1], labelled_error))
    return steps


def find_broken_relations(matches: Sequence[GoalMatch]) -> Iterator[Difference]:
    """Yield the relations of the first run that are outside the range of those of the other runs.

    A relation is the number of transitions of a goal before a transition of its plan or sub-goal.

    :param matches: the goals of the first run with those of each of the other runs, all without differences.
    """
    partners_by_goal = [dict(match.pairs) for match in matches]  # in each of the other runs
    for goal in partners_by_goal[0]:
        inner_threads = [
            *((child, GOAL_ITSELF) for child in goal.children),
            *((goal, plan) for plan in goal.threads if plan),
        ]
        for owner, plan in inner_threads:
            # by run, beginning with the first run
            outer_goals = [goal, *(partners[goal] for partners in partners_by_goal)]
            inner_steps = [
                run_owner.threads.get(plan, ())
                for run_owner in (owner, *(partners[owner] for partners in partners_by_goal))
            ]
            counts = [
                outer_goal.counts_before(steps)
                for outer_goal, steps in zip(outer_goals, inner_steps, strict=True)
            ]
            for index, step_counts in enumerate(zip(*counts, strict=True)):
                # a child may be formulated before its parent, depending on how the rules build the tree: the
                # first transition of the child counts as later in any case
                minimum = 1 if owner is not goal and index == 0 else 0
                count_a, *counts_b = (max(minimum, count) for count in step_counts)
                # the other runs may disagree: then all counts between their extremes are allowed
                agreed_count = min(max(count_a, min(counts_b)), max(counts_b))
                if count_a != agreed_count:
                    yield Difference(
                        f"'{_describe_state(inner_steps[0][index])}' on the other side of transitions"
                        f" of goal {goal.key.id}",
                        _describe_thread(matches[0], owner, plan),
                        Side(inner_steps[0][index].position, _describe_position(goal, count_a)),
                        Side(inner_steps[1][index].position, _describe_position(goal, agreed_count)),
                        DifferenceKind.ORDER,
                    )


def _describe_position(goal: Goal, count: int) -> str:
    """Return the text for a position among the transitions of a goal."""
    if count == 0:
        return "before its first transition"
    return f"after its transition number {count}, '{_describe_state(goal.transitions[count - 1])}'"


def _describe_state(step: Step) -> str:
    return " ".join(part for part in step.key[-3:] if part)


def compare_counts(a: Steps, b: Steps) -> Iterator[Difference]:
    """Yield the rules that fire, and the facts that are asserted or retracted, more often in one run.

    The order is not compared: without goals, the dependencies between these events are unknown.
    """
    counts = [Counter(step.key for step in steps) for steps in (a, b)]
    last_positions = [{step.key: step.position for step in steps} for steps in (a, b)]
    for key in counts[0] | counts[1]:
        count_a, count_b = (run_counts[key] for run_counts in counts)
        if count_a != count_b:
            side_a, side_b = (
                Side(positions.get(key), f"{count} times")
                for positions, count in zip(last_positions, (count_a, count_b), strict=True)
            )
            # the environment, and the rule or a fact's direction and text; the template, which precedes these
            # in the key of a fact, is also in the text
            subject = f"{key[1]}: {' '.join(key[2:][-2:])}"
            count = abs(count_a - count_b)
            description = "another number of times"
            yield Difference(description, subject, side_a, side_b, DifferenceKind.COUNT, count)
