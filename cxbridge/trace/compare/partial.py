"""Comparison in partial order: only dependent events must have the same order.

The goals of both runs are paired by their structure, and the transitions of each pair are compared in order.
Then the order between a goal and its plans and sub-goals is compared, as far as all other runs agree on that
order. docs/comparing.md, section "Partial order", has the definition.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from itertools import chain

from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.goal_matching import GoalMatch
from cxbridge.trace.compare.goals import GOAL_TRANSITIONS, Goal, GoalForest, GoalKey, Thread
from cxbridge.trace.compare.model import Comparison, Difference, DifferenceKind, Order, Side, sort_differences
from cxbridge.trace.compare.names import replace_fact_names, replace_names
from cxbridge.trace.compare.sequences import StepPair, Steps, find_step_differences, state_text


def compare_partial(
    a: Iterable[Event],
    other_runs: Sequence[Iterable[Event]],
    tolerance_s: float | None = None,
    missing_details: MissingDetails | None = None,
) -> Comparison:
    """Compare the transitions of a run with those of other runs, each read once.

    The run must have the same goals, plans and statuses as each of the other runs. Relations between a goal
    and its parent are compared only if all other runs agree on them.

    :param missing_details: details that are not compared.
    """
    forest_a = GoalForest(a, missing_details)
    matches: list[GoalMatch] = []
    for number, run in enumerate(other_runs):
        forest_b = GoalForest(run, missing_details)
        comparison = Comparison(
            View.TRANSITIONS, Order.PARTIAL, forest_a.count, forest_b.count, other_index=number
        )
        match = GoalMatch(forest_a, forest_b)
        steps = chain(
            _pair_steps(match, (forest_a, forest_b)), forest_a.skillers.pair_streams(forest_b.skillers)
        )
        comparison.differences = sort_differences(
            chain(_find_goal_differences(match), find_step_differences(steps, tolerance_s))
        )
        if not comparison.same:
            return comparison
        matches.append(match)
    # no single run differs in a relation, because all other runs agree: the report shows the first of them
    comparison.other_index = 0
    comparison.differences = sort_differences(_find_broken_relations(matches))
    return comparison


def _find_goal_differences(match: GoalMatch) -> Iterator[Difference]:
    """Yield the goals that only one run has."""
    missing_side = Side(None, "(no such goal)")
    for run_index, kind in enumerate((DifferenceKind.ONLY_A, DifferenceKind.ONLY_B)):
        for goal in match.unmatched_goals[run_index]:
            side = Side(goal.first_position, _describe_goal(goal))
            sides = (missing_side, side) if run_index else (side, missing_side)
            yield Difference(f"a goal that only {'AB'[run_index]} has", match.labels[goal], *sides, kind)


def _describe_goal(goal: Goal) -> str:
    subtree = f", with {goal.goal_count - 1} below it" if goal.goal_count > 1 else ""
    parent = f" below {goal.parent.id}" if goal.parent else ""
    return f"goal {goal.key.id} of class {goal.goal_class}, sub-type {goal.sub_type}{parent}{subtree}"


def _pair_steps(match: GoalMatch, forests: tuple[GoalForest, GoalForest]) -> Iterator[StepPair]:
    """Yield the transitions of all goals and plans, paired, and their details."""
    for goal_a, goal_b in match.pairs:
        for thread in goal_a.threads | goal_b.threads:
            steps_a, steps_b = (
                _label_errors(goal, forest, match)
                if thread == GOAL_TRANSITIONS
                else goal.threads.get(thread, ())
                for goal, forest in zip((goal_a, goal_b), forests, strict=True)
            )
            subject = _describe_thread(match, goal_a, thread)
            if not thread.has_details:
                yield StepPair(subject, "transition", (steps_a, steps_b))
                continue
            # an action that only one run has is a difference of the plan already, and details that only one
            # run has are not compared; the state of a detail begins with the id of its action
            actions = {step.state[0] for step in steps_a} & {step.state[0] for step in steps_b}
            steps_a, steps_b = (
                [step for step in steps if step.state[0] in actions] for steps in (steps_a, steps_b)
            )
            yield StepPair(f"details of {subject}", "value", (steps_a, steps_b), has_times=False)


def _describe_thread(match: GoalMatch, goal: Goal, thread: Thread) -> str:
    """Return the goal or plan of a thread, for differences."""
    subject = f"goal {match.labels[goal]}"
    return f"plan {thread.plan.replace('@', goal.key.id)} of {subject}" if thread.plan else subject


def _label_errors(goal: Goal, forest: GoalForest, match: GoalMatch) -> Steps:
    """Return the steps of a goal with labels instead of the ids of goals in its errors."""

    def label(word: str) -> str:
        named_goal = forest.goals.get(GoalKey(goal.key.env, word))
        return match.labels.get(named_goal, replace_names(word)) if named_goal else replace_names(word)

    return [
        step._replace(state=(mode, outcome, " ".join(map(label, error.split())))) if error else step
        for step in goal.transitions
        for mode, outcome, error in [step.state]
    ]


def _find_broken_relations(matches: Sequence[GoalMatch]) -> Iterator[Difference]:
    """Yield the relations on which the other runs agree and which the first run breaks.

    A relation is the number of transitions of a goal before a transition of its plan or sub-goal.

    :param matches: the goals of the first run with those of each of the other runs, all without differences.
    """
    partners = [dict(match.pairs) for match in matches]
    for goal in partners[0]:
        inner_threads = [
            *((child, GOAL_TRANSITIONS) for child in goal.children),
            *((goal, thread) for thread in goal.threads if thread.plan and not thread.has_details),
        ]
        for owner, thread in inner_threads:
            runs = [(goal, owner), *((partner[goal], partner[owner]) for partner in partners)]
            inner_steps = [run_owner.threads.get(thread, ()) for _, run_owner in runs]
            counts = [
                outer_goal.counts_before(steps)
                for (outer_goal, _), steps in zip(runs, inner_steps, strict=True)
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
                        f"'{state_text(inner_steps[0][index].state)}' on the other side of transitions"
                        f" of goal {goal.key.id}",
                        _describe_thread(matches[0], owner, thread),
                        Side(inner_steps[0][index].position, _describe_position(goal, count_a)),
                        Side(inner_steps[1][index].position, _describe_position(goal, agreed_count)),
                        DifferenceKind.ORDER,
                    )


def _describe_position(goal: Goal, count: int) -> str:
    """Return the text for a position among the transitions of a goal."""
    if count == 0:
        return "before its first transition"
    return f"after its transition number {count}, '{state_text(goal.transitions[count - 1].state)}'"


def compare_counts(a: Iterable[Event], b: Iterable[Event], view: View) -> Comparison:
    """Compare how often each rule fires, or each fact is asserted and retracted.

    The order is not compared: without goals, the dependencies between these events are unknown.
    """
    runs = _EventCounts(a), _EventCounts(b)
    differences = []
    for text in runs[0].counts | runs[1].counts:
        times_a, times_b = (run.counts[text] for run in runs)
        if times_a != times_b:
            side_a, side_b = (Side(run.last_position.get(text), f"{run.counts[text]} times") for run in runs)
            differences.append(
                Difference(
                    "another number of times",
                    text,
                    side_a,
                    side_b,
                    DifferenceKind.COUNT,
                    abs(times_a - times_b),
                )
            )
    count_a, count_b = (run.counts.total() for run in runs)
    return Comparison(view, Order.PARTIAL, count_a, count_b, sort_differences(differences))


class _EventCounts:
    """The number and last position of each firing or change of a fact."""

    def __init__(self, events: Iterable[Event]) -> None:
        self.counts: Counter[str] = Counter()
        self.last_position: dict[str, int] = {}
        for position, event in enumerate(events):
            if isinstance(event, RuleFired):
                text = f"{event.env}: {event.rule}"
            else:
                assert isinstance(event, FactChange)
                arrow = "==>" if event.asserted else "<=="
                text = f"{event.env}: {arrow} {replace_fact_names(event.text)}"
            self.counts[text] += 1
            self.last_position[text] = position
