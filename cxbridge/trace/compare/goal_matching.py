"""Matching of the goals of two runs.

Ids of goals differ between runs, and the order of siblings may differ. Goals are therefore matched by their
place in the tree of goals and by their behaviour: transitions, plans and sub-goals.
"""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from cxbridge.trace.compare.align import pop_equal_pairs, remove_pairs
from cxbridge.trace.compare.goals import Goal, GoalForest, goal_signatures
from cxbridge.trace.compare.names import replace_names

MIN_SIMILARITY: Final = 0.5
"""The minimum similarity of paired goals whose classes or parents differ."""

MAX_COMPARED_PAIRS: Final = 900
"""The maximum number of pairs of siblings whose similarity is computed; above it the order decides.

The time grows with the square of the number of siblings.
"""

MAX_CANDIDATES: Final = 50
"""The maximum number of unpaired goals of the same kind to which a goal is compared."""

GoalPair: TypeAlias = tuple[Goal, Goal]


@dataclass(slots=True)
class GoalMatch:
    """The paired goals, parents before their children.

    :param pairs: the pairs of goals of both runs.
    :param unmatched_goals: the goals of each run without a partner.
    :param moved_pairs: the pairs with different parents.
    :param renamed_pairs: the pairs with different classes or ids.
    :param labels: the name of each goal in reports, equal for both goals of a pair.
    """

    pairs: list[GoalPair] = field(default_factory=list)
    unmatched_goals: tuple[list[Goal], list[Goal]] = field(default_factory=lambda: ([], []))
    moved_pairs: list[GoalPair] = field(default_factory=list)
    renamed_pairs: list[GoalPair] = field(default_factory=list)
    labels: dict[Goal, str] = field(default_factory=dict)


def match_goals(a: GoalForest, b: GoalForest) -> GoalMatch:
    """Pair the goals of two runs, from the roots down.

    Goals form a pair if their parents do, and environment, class, sub-type and id without gensym number are
    equal. Of several such siblings, those with equal behaviour are paired first, then the most similar ones.
    The remaining goals are paired with similar goals of another parent or class; such pairs are differences.
    """
    matcher = _Matcher(a, b)
    matcher.pair_siblings("", a.roots, b.roots)
    matcher.pair_moved_goals()
    return matcher.match


class _Matcher:
    """Pairs the goals of two runs."""

    def __init__(self, a: GoalForest, b: GoalForest) -> None:
        self.match = GoalMatch()
        self._signatures: list[dict[Goal, int]] = []
        self._label_counts: Counter[str] = Counter()
        for with_parent in (True, False):
            numbers: dict[object, int] = {}
            signatures = [goal_signatures(forest, numbers, with_parent=with_parent) for forest in (a, b)]
            self._signatures.append(signatures[0] | signatures[1])

    def pair_siblings(self, path: str, siblings_a: list[Goal], siblings_b: list[Goal]) -> None:
        """Pair siblings and their descendants."""
        stack = [(path, siblings_a, siblings_b)]
        while stack:
            path, goals_a, goals_b = stack.pop()
            goals_a, goals_b = list(goals_a), list(goals_b)
            indices = {goal: index for siblings in (goals_a, goals_b) for index, goal in enumerate(siblings)}
            pairs: list[GoalPair] = []
            # first the goals with equal behaviour, if possible with the same index among their siblings
            for signatures in self._signatures:
                signatures_with_index = {goal: (signatures[goal], index) for goal, index in indices.items()}
                pairs += pop_equal_pairs(goals_a, goals_b, signatures_with_index.__getitem__)
                pairs += pop_equal_pairs(goals_a, goals_b, signatures.__getitem__)
            pairs += _pop_similar_pairs(goals_a, goals_b)
            # last the goals of another class, so that a goal of the same class is preferred
            renamed_pairs = _pop_renamed_pairs(goals_a, goals_b)
            self.match.renamed_pairs += renamed_pairs
            stack += [
                (self._add_pair(path, pair), pair[0].children, pair[1].children)
                for pair in (*pairs, *renamed_pairs)
            ]
            for unmatched_goals, goals in zip(self.match.unmatched_goals, (goals_a, goals_b), strict=True):
                unmatched_goals.extend(goals)
                self.match.labels.update({goal: self._make_label(path, goal) for goal in goals})

    def pair_moved_goals(self) -> None:
        """Pair the remaining goals with similar goals of other parents."""
        by_kind: dict[object, list[Goal]] = defaultdict(list)
        unmatched_a, unmatched_b = self.match.unmatched_goals
        for candidate in unmatched_b:
            by_kind[candidate.kind].append(candidate)
        for goal_a in list(unmatched_a):
            goal_b = max(by_kind[goal_a.kind][:MAX_CANDIDATES], key=goal_a.similarity, default=None)
            if goal_b is None or goal_a.similarity(goal_b) < MIN_SIMILARITY:
                continue
            by_kind[goal_a.kind].remove(goal_b)
            unmatched_a.remove(goal_a)
            unmatched_b.remove(goal_b)
            self.match.moved_pairs.append((goal_a, goal_b))
            self.match.pairs.append((goal_a, goal_b))
            label = self.match.labels[goal_b] = self.match.labels[goal_a]
            self.pair_siblings(label, goal_a.children, goal_b.children)

    def _add_pair(self, path: str, pair: GoalPair) -> str:
        """Add a pair; return its label."""
        self.match.pairs.append(pair)
        label = self._make_label(path, pair[0])
        self.match.labels.update(dict.fromkeys(pair, label))
        return label

    def _make_label(self, path: str, goal: Goal) -> str:
        """Return a unique label for a goal: the id without its number, or the class."""
        # `RUN-gen3` is `RUN`; `gen3` is nothing but a number, so that the class names the goal
        name = replace_names(goal.key[1]).replace("gen#", "").strip("-") or goal.goal_class
        label = f"{path}/{name}"
        self._label_counts[label] += 1
        return label if self._label_counts[label] == 1 else f"{label}[{self._label_counts[label]}]"


def _pop_similar_pairs(goals_a: list[Goal], goals_b: list[Goal]) -> list[GoalPair]:
    """Remove pairs of the same kind from siblings, the most similar first, and return them."""
    kinds: dict[object, tuple[list[Goal], list[Goal]]] = defaultdict(lambda: ([], []))
    for run_index, goals in enumerate((goals_a, goals_b)):
        for goal in goals:
            kinds[goal.kind][run_index].append(goal)
    pairs: list[GoalPair] = []
    for group in kinds.values():
        is_comparable = 1 < len(group[0]) * len(group[1]) <= MAX_COMPARED_PAIRS
        # one run may have more goals of a kind
        pairs += _pair_most_similar(*group, 0.0) if is_comparable else zip(*group, strict=False)
    remove_pairs(pairs, goals_a, goals_b)
    return pairs


def _pop_renamed_pairs(goals_a: list[Goal], goals_b: list[Goal]) -> list[GoalPair]:
    """Remove pairs of different kinds but similar behaviour from siblings, and return them."""
    if len(goals_a) * len(goals_b) > MAX_COMPARED_PAIRS:
        return []
    pairs = [
        pair
        for pair in _pair_most_similar(goals_a, goals_b, MIN_SIMILARITY)
        if pair[0].key[0] == pair[1].key[0]
    ]
    remove_pairs(pairs, goals_a, goals_b)
    return pairs


def _pair_most_similar(
    goals_a: Sequence[Goal], goals_b: Sequence[Goal], min_similarity: float
) -> list[GoalPair]:
    """Pair goals by decreasing similarity, equally similar goals by the closeness of their indices.

    :returns: the pairs in the order of the first run.
    """
    ranking = sorted(
        (-goal_a.similarity(goal_b), abs(i - j), i, j)
        for i, goal_a in enumerate(goals_a)
        for j, goal_b in enumerate(goals_b)
    )
    paired: tuple[set[int], set[int]] = (set(), set())
    pairs: list[GoalPair] = []
    for negative_similarity, _, i, j in ranking:
        if -negative_similarity >= min_similarity and i not in paired[0] and j not in paired[1]:
            paired[0].add(i)
            paired[1].add(j)
            pairs.append((goals_a[i], goals_b[j]))
    return sorted(pairs, key=lambda pair: pair[0].first_position)
