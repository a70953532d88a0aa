"""Matching of the goals of two runs.

Ids of goals differ between runs, and the order of siblings may differ. Goals are therefore matched by their
place in the tree of goals and by their behaviour: transitions, plans and sub-goals.
"""

from __future__ import annotations

from collections import Counter
from itertools import chain
from operator import attrgetter
from typing import Final, TypeAlias

from cxbridge.trace.compare.align import pop_equal_pairs, remove_pairs
from cxbridge.trace.compare.goals import Goal, GoalForest, goal_signatures
from cxbridge.trace.compare.names import replace_names
from cxbridge.trace.compare.steps import Key

MAX_COMPARED_PAIRS: Final = 900
"""The maximum number of pairs of siblings whose similarity is computed; above it the order decides.

The time grows with the square of the number of siblings.
"""

GoalPair: TypeAlias = tuple[Goal, Goal]


class GoalMatch:
    """The paired goals of two runs.

    Goals form a pair if their parents do, and environment, class, sub-type and id without gensym number are
    equal. Of several such siblings, those with equal behaviour are paired first, then the most similar ones,
    and the remaining siblings in their order.

    :ivar pairs: the pairs of goals of both runs, parents before their children.
    :ivar unmatched_goals: the goals of each run without a partner, but not the goals below them.
    :ivar forests: the goals of both runs.
    :ivar labels: the name in reports of each paired or unmatched goal, equal for both goals of a pair.
    """

    def __init__(self, a: GoalForest, b: GoalForest) -> None:
        self.forests = (a, b)
        self.pairs: list[GoalPair] = []
        self.unmatched_goals: tuple[list[Goal], list[Goal]] = ([], [])
        self.labels: dict[Goal, str] = {}
        self._label_counts: Counter[str] = Counter()
        # with the place among the transitions of the parent, and without: equal places are paired first
        self._signatures: list[dict[Goal, int]] = []
        for with_parent in (True, False):
            numbers: dict[object, int] = {}
            signatures = [goal_signatures(forest, numbers, with_parent=with_parent) for forest in (a, b)]
            self._signatures.append(signatures[0] | signatures[1])
        self._pair_goals(a.roots, b.roots)

    def _pair_goals(self, roots_a: list[Goal], roots_b: list[Goal]) -> None:
        """Pair the goals of two trees, from the roots down."""
        stack = [("", roots_a, roots_b)]
        while stack:
            path, siblings_a, siblings_b = stack.pop()
            goals_a, goals_b = list(siblings_a), list(siblings_b)
            for goal_a, goal_b in self._pop_pairs(goals_a, goals_b):
                self.pairs.append((goal_a, goal_b))
                label = self._make_label(path, goal_a)
                self.labels[goal_a] = self.labels[goal_b] = label
                stack.append((label, goal_a.children, goal_b.children))
            for unmatched_goals, goals in zip(self.unmatched_goals, (goals_a, goals_b), strict=True):
                unmatched_goals.extend(goals)
                self.labels.update({goal: self._make_label(path, goal) for goal in goals})

    def _pop_pairs(self, goals_a: list[Goal], goals_b: list[Goal]) -> list[GoalPair]:
        """Remove pairs from siblings, and return them."""
        pairs: list[GoalPair] = []
        indices = {goal: index for siblings in (goals_a, goals_b) for index, goal in enumerate(siblings)}
        # first the goals with equal behaviour, if possible with the same index among their siblings
        for signatures in self._signatures:
            signatures_with_index = {goal: (signatures[goal], index) for goal, index in indices.items()}
            pairs += pop_equal_pairs(goals_a, goals_b, signatures_with_index.__getitem__)
            pairs += pop_equal_pairs(goals_a, goals_b, signatures.__getitem__)
        if len(goals_a) * len(goals_b) <= MAX_COMPARED_PAIRS:
            pairs += _pop_similar_pairs(goals_a, goals_b)
        return pairs + pop_equal_pairs(goals_a, goals_b, attrgetter("kind"))

    def _make_label(self, path: str, goal: Goal) -> str:
        """Return a unique label for a goal: the id without its number, or the class."""
        # `RUN-gen3` is `RUN`; `gen3` is nothing but a number, so that the class names the goal
        name = replace_names(goal.key.id).replace("gen#", "").strip("-") or goal.goal_class
        label = f"{path}/{name}"
        self._label_counts[label] += 1
        return label if self._label_counts[label] == 1 else f"{label}[{self._label_counts[label]}]"


def _pop_similar_pairs(goals_a: list[Goal], goals_b: list[Goal]) -> list[GoalPair]:
    """Remove pairs of the same kind from siblings, the most similar first, and return them.

    Equally similar goals are paired by the closeness of their indices.
    """
    behaviours = {goal: _count_behaviour(goal) for goal in (*goals_a, *goals_b)}
    ranking = sorted(
        (-_similarity(behaviours[goal_a], behaviours[goal_b]), abs(index_a - index_b), index_a, index_b)
        for index_a, goal_a in enumerate(goals_a)
        for index_b, goal_b in enumerate(goals_b)
        if goal_a.kind == goal_b.kind
    )
    paired_goals: set[Goal] = set()
    pairs: list[GoalPair] = []
    for *_, index_a, index_b in ranking:
        pair = goals_a[index_a], goals_b[index_b]
        if paired_goals.isdisjoint(pair):
            paired_goals.update(pair)
            pairs.append(pair)
    remove_pairs(pairs, goals_a, goals_b)
    return sorted(pairs, key=lambda pair: pair[0].first_position)


def _count_behaviour(goal: Goal) -> Counter[Key]:
    """Count the steps of a goal and its plans, and the classes of the children."""
    children = ((child.goal_class, child.sub_type) for child in goal.children)
    return Counter(chain(*(keys for _, keys in goal.find_keys()), children))


def _similarity(a: Counter[Key], b: Counter[Key]) -> float:
    """Return the share of equal behaviour of two goals, in any order, from 0 to 1."""
    return 2 * (a & b).total() / max(1, a.total() + b.total())
