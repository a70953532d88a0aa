"""Comparison in partial order: only dependent events must have the same order.

The definition is in docs/comparing.md, section "Partial order".
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import chain
from typing import TypeAlias

from cxbridge.event_kinds import View
from cxbridge.events import Event, FactChange, RuleFired
from cxbridge.trace.compare.checks import Tolerance
from cxbridge.trace.compare.details import MissingDetails
from cxbridge.trace.compare.goal_matching import GoalMatch, match_goals
from cxbridge.trace.compare.goals import Goal, GoalForest
from cxbridge.trace.compare.keys import scenario_hints
from cxbridge.trace.compare.model import Comparison, Difference, DifferenceKind, Order, Side
from cxbridge.trace.compare.names import anonymous, anonymous_fact
from cxbridge.trace.compare.sequences import StepPair, Steps, compare_steps, text_of

Relation: TypeAlias = tuple[Goal, str]
"""A goal of the first run and its plan; an empty plan means the goal's own transitions."""


def compare_partial(
    a: Iterable[Event],
    others: Sequence[Iterable[Event]],
    tolerance: Tolerance | None = None,
    missing: MissingDetails | None = None,
) -> Comparison:
    """Compare the transitions of a run with those of other runs, each read once.

    The run must have the same goals, plans and statuses as each of the other runs. Of the relations between a
    goal and its parent only those are compared on which all other runs agree.

    :param missing: details that do not count.
    """
    ours = GoalForest(a, missing)
    relations: dict[Relation, _AgreedRelation] = {}
    for number, run in enumerate(others):
        theirs = GoalForest(run, missing)
        comparison = Comparison(View.TRANSITIONS, Order.PARTIAL, ours.count, theirs.count, other=number)
        match = match_goals(ours, theirs)
        steps = chain(_step_pairs(match, (ours, theirs)), ours.skillers.pairs(theirs.skillers))
        begin = ours.start_us, theirs.start_us
        compare_steps(comparison, steps, begin, tolerance, _goal_differences(match))
        if not comparison.same:
            comparison.hints += scenario_hints(ours.scopes, theirs.scopes)
            return comparison
        _agree(relations, match)
    comparison.other = 0
    comparison.keep(sorted(_broken(relations), key=lambda difference: difference.position))
    return comparison


def _goal_differences(match: GoalMatch) -> Iterator[Difference]:
    """Yield the goals that only one run has, or that differ in parent or class."""
    missing = Side(None, "(no such goal)")
    for run, kind in enumerate((DifferenceKind.ONLY_A, DifferenceKind.ONLY_B)):
        for goal in match.only[run]:
            there = Side(goal.start, _goal_text(goal))
            sides = (missing, there) if run else (there, missing)
            yield Difference(f"a goal that only {'AB'[run]} has", match.labels[goal], *sides, kind)
    for noun, text, pairs in (
        ("another parent", _parent_text, match.adopted),
        ("another class or id", _named, match.renamed),
    ):
        for pair in pairs:
            ours, theirs = (Side(goal.start, text(goal)) for goal in pair)
            yield Difference(noun, f"goal {match.labels[pair[0]]}", ours, theirs)


def _parent_text(goal: Goal) -> str:
    """Return the text for the parent of a goal."""
    return f"goal {goal.key[1]} below {goal.parent[1] if goal.parent else 'no parent'}"


def _named(goal: Goal) -> str:
    """Return id, class and sub-type of a goal as text."""
    return f"goal {goal.key[1]} of class {goal.goal_class}, sub-type {goal.sub_type}"


def _goal_text(goal: Goal) -> str:
    more = f", with {goal.size - 1} below it" if goal.size > 1 else ""
    return f"goal {goal.key[1]} of class {goal.goal_class}{more}"


def _step_pairs(match: GoalMatch, forests: tuple[GoalForest, GoalForest]) -> Iterator[StepPair]:
    """Yield the transitions of all goals and plans, paired, and their details."""
    for pair in match.pairs:
        one, other = pair
        subject = f"goal {match.labels[one]}"
        own = (_renamed(one, forests[0], match), _renamed(other, forests[1], match))
        yield StepPair(subject, "transition", own)
        details: list[tuple[str, Steps, Steps]] = [(subject, one.details, other.details)]
        for plan in {**one.plans, **other.plans}:
            name = _plan_subject(match, one, plan)
            yield StepPair(name, "transition", (one.plans.get(plan, ()), other.plans.get(plan, ())))
            said = [goal.plan_details.get(plan, []) for goal in pair]
            actions = set.intersection(*({step.state[0] for step in steps} for steps in said))
            # an action that only one run has is a difference already
            ours, theirs = ([step for step in steps if step.state[0] in actions] for steps in said)
            details.append((name, ours, theirs))
        for name, *said_of in details:
            if all(said_of):
                yield StepPair(f"details of {name}", "value", (said_of[0], said_of[1]), timed=False)


def _plan_subject(match: GoalMatch, goal: Goal, plan: str) -> str:
    """Return the name of a plan in differences."""
    return f"plan {plan.replace('@', goal.key[1])} of goal {match.labels[goal]}"


def _renamed(goal: Goal, forest: GoalForest, match: GoalMatch) -> Steps:
    """Return the steps of a goal with the labels of goals in its errors."""

    def label(word: str) -> str:
        named = forest.goals.get((goal.key[0], word))
        return anonymous(word) if named is None else match.labels[named]

    return [
        step._replace(state=(*step.state[:2], " ".join(map(label, step.state[2].split()))))
        if step.state[2]
        else step
        for step in goal.own
    ]


@dataclass(slots=True)
class _AgreedRelation:
    """The numbers of a goal's transitions before those of a plan or sub-goal.

    :param outer: the goal whose transitions are counted; ``inner``: the transitions after them.
    :param counts: the numbers in each of the other runs.
    :param theirs: the transitions in the first of the other runs.
    """

    subject: str
    outer: Goal
    inner: Steps
    ours: list[int]
    theirs: Steps
    counts: list[list[int]]


def _agree(agreed: dict[Relation, _AgreedRelation], match: GoalMatch) -> None:
    """Add the relations of another run."""
    partners = dict(match.pairs)
    for one, other in match.pairs:
        for child in one.children:
            place, subject = (child, ""), f"goal {match.labels[child]}"
            _relate(agreed, place, subject, (one, child.own), (other, partners[child].own))
        for plan, steps in one.plans.items():
            subject = _plan_subject(match, one, plan)
            _relate(agreed, (one, plan), subject, (one, steps), (other, other.plans[plan]))


def _relate(
    agreed: dict[Relation, _AgreedRelation],
    place: Relation,
    subject: str,
    ours: tuple[Goal, Steps],
    theirs: tuple[Goal, Steps],
) -> None:
    """Add the relations between the transitions of a goal and those of a child or plan."""
    counts = [outer.before(inner) for outer, inner in (ours, theirs)]
    if not place[1]:
        # the way the tree is built decides whether parent or child is formulated first
        for count in counts:
            count[:1] = [max(1, first) for first in count[:1]]
    known = agreed.setdefault(place, _AgreedRelation(subject, *ours, counts[0], theirs[1], []))
    known.counts.append(counts[1])


def _broken(agreed: dict[Relation, _AgreedRelation]) -> Iterator[Difference]:
    """Yield the relations on which the other runs agree and which the first run breaks."""
    for relation in agreed.values():
        for at, ours in enumerate(relation.ours):
            theirs = [counts[at] for counts in relation.counts]
            wanted = min(max(ours, min(theirs)), max(theirs))
            if ours != wanted:
                yield Difference(
                    f"'{text_of(relation.inner[at].state)}' on the other side of transitions"
                    f" of goal {relation.outer.key[1]}",
                    relation.subject,
                    Side(relation.inner[at].position, _position_text(relation.outer, ours)),
                    Side(relation.theirs[at].position, _position_text(relation.outer, wanted)),
                    DifferenceKind.ORDER,
                )


def _position_text(goal: Goal, count: int) -> str:
    """Return the text for a position among the transitions of a goal."""
    if count == 0:
        return "before its first transition"
    return f"after its transition number {count}, '{text_of(goal.own[count - 1].state)}'"


def compare_counts(a: Iterable[Event], b: Iterable[Event], view: View) -> Comparison:
    """Compare the numbers of firings of each rule, or of assertions and retractions of each fact.

    Their order is not compared, because without goals their dependencies are unknown.
    """
    runs = _EventCounts(a), _EventCounts(b)
    differences = []
    for text in runs[0].counts | runs[1].counts:
        counts = [run.counts[text] for run in runs]
        if counts[0] != counts[1]:
            ours, theirs = (Side(run.last_position.get(text), f"{run.counts[text]} times") for run in runs)
            surplus = abs(counts[0] - counts[1])
            differences.append(
                Difference("another number of times", text, ours, theirs, DifferenceKind.COUNT, surplus)
            )
    comparison = Comparison(view, Order.PARTIAL, runs[0].counts.total(), runs[1].counts.total())
    comparison.keep(sorted(differences, key=lambda difference: difference.position))
    comparison.hints = scenario_hints(runs[0].scopes, runs[1].scopes)
    return comparison


class _EventCounts:
    """The number and last position of each firing or change of a fact."""

    def __init__(self, events: Iterable[Event]) -> None:
        self.counts: Counter[str] = Counter()
        self.last_position: dict[str, int] = {}
        self.scopes: set[str] = set()
        for position, event in enumerate(events):
            if isinstance(event, RuleFired):
                text = f"{event.env}: {event.rule}"
                self.scopes.add(f"rule {event.rule}")
            else:
                assert isinstance(event, FactChange)
                arrow = "==>" if event.asserted else "<=="
                text = f"{event.env}: {arrow} {anonymous_fact(event.text)}"
                self.scopes.add(f"template {event.template}")
            self.counts[text] += 1
            self.last_position[text] = position
