"""Comparison in partial order: only dependent events must have the same order.

The goals of both runs are paired by their structure, and the transitions of each pair are compared in order.
Then the order between a goal and its plans and sub-goals is compared, as far as all other runs agree on that
order. docs/comparing.md, section "Partial order", has the definition.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeAlias

from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.goal_matching import GoalMatch
from cxbridge.trace.compare.goals import Goal, GoalForest
from cxbridge.trace.compare.model import Comparison, Difference, DifferenceKind, Order, Side, sort_differences
from cxbridge.trace.compare.names import replace_fact_names, replace_names
from cxbridge.trace.compare.sequences import StepPair, Steps, find_step_differences, state_text

RelationKey: TypeAlias = tuple[Goal, str]
"""A goal of the first run and its plan; an empty plan stands for the transitions of the goal itself."""


def compare_partial(
    a: Iterable[Event],
    others: Sequence[Iterable[Event]],
    tolerance_s: float | None = None,
    missing: MissingDetails | None = None,
) -> Comparison:
    """Compare the transitions of a run with those of other runs, each read once.

    The run must have the same goals, plans and statuses as each of the other runs. Relations between a goal
    and its parent are compared only if all other runs agree on them.

    :param missing: details that are not compared.
    """
    forest_a = GoalForest(a, missing)
    relations: dict[RelationKey, _AgreedRelation] = {}
    for number, run in enumerate(others):
        forest_b = GoalForest(run, missing)
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
        _add_relations(relations, match)
    # no single run differs in a relation, because all other runs agree: the report shows the first of them
    comparison.other_index = 0
    comparison.differences = sort_differences(_find_broken_relations(relations))
    return comparison


def _find_goal_differences(match: GoalMatch) -> Iterator[Difference]:
    """Yield the goals that only one run has."""
    missing = Side(None, "(no such goal)")
    for run_index, kind in enumerate((DifferenceKind.ONLY_A, DifferenceKind.ONLY_B)):
        for goal in match.unmatched_goals[run_index]:
            side = Side(goal.first_position, _describe_goal(goal))
            sides = (missing, side) if run_index else (side, missing)
            yield Difference(f"a goal that only {'AB'[run_index]} has", match.labels[goal], *sides, kind)


def _describe_goal(goal: Goal) -> str:
    subtree = f", with {goal.goal_count - 1} below it" if goal.goal_count > 1 else ""
    parent = f" below {goal.parent[1]}" if goal.parent else ""
    return f"goal {goal.key[1]} of class {goal.goal_class}, sub-type {goal.sub_type}{parent}{subtree}"


def _pair_steps(match: GoalMatch, forests: tuple[GoalForest, GoalForest]) -> Iterator[StepPair]:
    """Yield the transitions of all goals and plans, paired, and their details."""
    for pair in match.pairs:
        goal_a, goal_b = pair
        subject = f"goal {match.labels[goal_a]}"
        transitions = (_label_errors(goal_a, forests[0], match), _label_errors(goal_b, forests[1], match))
        yield StepPair(subject, "transition", transitions)
        details: list[tuple[str, Steps, Steps]] = [(subject, goal_a.details, goal_b.details)]
        for plan in {**goal_a.plans, **goal_b.plans}:
            name = _describe_plan(match, goal_a, plan)
            yield StepPair(name, "transition", (goal_a.plans.get(plan, ()), goal_b.plans.get(plan, ())))
            plan_details = [goal.plan_details.get(plan, []) for goal in pair]
            actions = set.intersection(*({step.state[0] for step in steps} for steps in plan_details))
            # an action that only one run has is a difference of the plan already
            steps_a, steps_b = (
                [step for step in steps if step.state[0] in actions] for steps in plan_details
            )
            details.append((name, steps_a, steps_b))
        for name, *sides in details:
            if all(sides):
                yield StepPair(f"details of {name}", "value", (sides[0], sides[1]), has_times=False)


def _describe_plan(match: GoalMatch, goal: Goal, plan: str) -> str:
    """Return the name of a plan in differences."""
    return f"plan {plan.replace('@', goal.key[1])} of goal {match.labels[goal]}"


def _label_errors(goal: Goal, forest: GoalForest, match: GoalMatch) -> Steps:
    """Return the steps of a goal with labels instead of the ids of goals in its errors."""

    def label(word: str) -> str:
        mentioned = forest.goals.get((goal.key[0], word))
        return match.labels.get(mentioned, replace_names(word)) if mentioned else replace_names(word)

    return [
        step._replace(state=(*step.state[:2], " ".join(map(label, step.state[2].split()))))
        if step.state[2]
        else step
        for step in goal.transitions
    ]


@dataclass(slots=True)
class _AgreedRelation:
    """How many transitions of a goal precede each transition of its plan or sub-goal.

    :param outer: the goal whose transitions are counted.
    :param inner: the transitions of the plan or sub-goal in the first run.
    :param counts_a: the number of transitions of ``outer`` before each transition of ``inner``.
    :param inner_b: the transitions of the plan or sub-goal in the first of the other runs.
    :param counts_b: as ``counts_a``, for each of the other runs.
    """

    subject: str
    outer: Goal
    inner: Steps
    counts_a: list[int]
    inner_b: Steps
    counts_b: list[list[int]]


def _add_relations(relations: dict[RelationKey, _AgreedRelation], match: GoalMatch) -> None:
    """Add the relations of another run."""
    partners = dict(match.pairs)
    for goal_a, goal_b in match.pairs:
        for child in goal_a.children:
            key, subject = (child, ""), f"goal {match.labels[child]}"
            _add_relation(
                relations, key, subject, (goal_a, child.transitions), (goal_b, partners[child].transitions)
            )
        for plan, steps in goal_a.plans.items():
            subject = _describe_plan(match, goal_a, plan)
            _add_relation(relations, (goal_a, plan), subject, (goal_a, steps), (goal_b, goal_b.plans[plan]))


def _add_relation(
    relations: dict[RelationKey, _AgreedRelation],
    key: RelationKey,
    subject: str,
    side_a: tuple[Goal, Steps],
    side_b: tuple[Goal, Steps],
) -> None:
    """Add the relations between the transitions of a goal and those of a child or plan."""
    counts = [outer.counts_before(inner) for outer, inner in (side_a, side_b)]
    if not key[1]:
        # a child may be formulated before its parent, depending on how the rules build the tree: the first
        # transition of the child counts as later in any case
        for count in counts:
            count[:1] = [max(1, first_count) for first_count in count[:1]]
    relation = relations.setdefault(key, _AgreedRelation(subject, *side_a, counts[0], side_b[1], []))
    relation.counts_b.append(counts[1])


def _find_broken_relations(relations: dict[RelationKey, _AgreedRelation]) -> Iterator[Difference]:
    """Yield the relations on which the other runs agree and which the first run breaks."""
    for relation in relations.values():
        for index, count_a in enumerate(relation.counts_a):
            counts_b = [counts[index] for counts in relation.counts_b]
            # the other runs may disagree: then all counts between their extremes are allowed
            agreed_count = min(max(count_a, min(counts_b)), max(counts_b))
            if count_a != agreed_count:
                yield Difference(
                    f"'{state_text(relation.inner[index].state)}' on the other side of transitions"
                    f" of goal {relation.outer.key[1]}",
                    relation.subject,
                    Side(relation.inner[index].position, _describe_position(relation.outer, count_a)),
                    Side(relation.inner_b[index].position, _describe_position(relation.outer, agreed_count)),
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
        counts = [run.counts[text] for run in runs]
        if counts[0] != counts[1]:
            side_a, side_b = (Side(run.last_position.get(text), f"{run.counts[text]} times") for run in runs)
            surplus = abs(counts[0] - counts[1])
            differences.append(
                Difference("another number of times", text, side_a, side_b, DifferenceKind.COUNT, surplus)
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
