"""Matching of the goals of two runs by structure instead of ids or order alone."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final, TypeAlias

from cxbridge.trace.compare.align import drop_pairs, take_equal
from cxbridge.trace.compare.goals import Goal, GoalForest, signatures_of
from cxbridge.trace.compare.names import anonymous

MIN_SIMILARITY: Final = 0.5
"""The minimal similarity of paired goals whose classes or parents differ."""

MAX_COMPARED: Final = 900
"""The maximal number of pairs of siblings whose similarity is computed; above it the order decides.

The time grows with the square of the number of siblings.
"""

MAX_CANDIDATES: Final = 50
"""The maximal number of unpaired goals of the same kind to which a goal is compared."""

Pair: TypeAlias = tuple[Goal, Goal]


@dataclass(slots=True)
class GoalMatch:
    """The paired goals, parents before their children.

    :param pairs: the pairs of goals of both runs.
    :param unmatched: the goals of each run without a partner.
    :param moved: the pairs with different parents.
    :param renamed: the pairs with different classes or ids.
    :param labels: the name of each goal in reports, equal for both goals of a pair.
    """

    pairs: list[Pair] = field(default_factory=list)
    unmatched: tuple[list[Goal], list[Goal]] = field(default_factory=lambda: ([], []))
    moved: list[Pair] = field(default_factory=list)
    renamed: list[Pair] = field(default_factory=list)
    labels: dict[Goal, str] = field(default_factory=dict)


def match_goals(a: GoalForest, b: GoalForest) -> GoalMatch:
    """Pair the goals of two runs, from the roots down.

    Goals form a pair if their parents do, and environment, class, sub-type and id without gensym number are
    equal. Among several such siblings, those with equal behaviour are paired first, then the most similar
    ones. The remaining goals are paired with similar goals of another parent or class, and such pairs are
    differences.
    """
    matcher = _Matcher(a, b)
    matcher.pair_siblings("", a.roots, b.roots)
    matcher.pair_moved()
    return matcher.match


class _Matcher:
    """Pairs the goals of two runs."""

    def __init__(self, a: GoalForest, b: GoalForest) -> None:
        self.match = GoalMatch()
        self._signatures: list[dict[Goal, int]] = []
        self._counts: Counter[str] = Counter()
        for with_parent in (True, False):
            numbers: dict[object, int] = {}
            signatures = [signatures_of(forest, numbers, with_parent=with_parent) for forest in (a, b)]
            self._signatures.append(signatures[0] | signatures[1])

    def pair_siblings(self, path: str, siblings_a: list[Goal], siblings_b: list[Goal]) -> None:
        """Pair siblings and their descendants."""
        stack = [(path, siblings_a, siblings_b)]
        while stack:
            path, goals_a, goals_b = stack.pop()
            goals_a, goals_b = list(goals_a), list(goals_b)
            indices = {goal: index for siblings in (goals_a, goals_b) for index, goal in enumerate(siblings)}
            pairs: list[Pair] = []
            # goals that did exactly the same, if possible at the same place among their siblings
            for signatures in self._signatures:
                placed_signatures = {goal: (signatures[goal], index) for goal, index in indices.items()}
                pairs += take_equal(goals_a, goals_b, placed_signatures.__getitem__)
                pairs += take_equal(goals_a, goals_b, signatures.__getitem__)
            pairs += _take_similar(goals_a, goals_b)
            # the last resort among siblings, so that a goal of the same class is preferred
            renamed = _take_renamed(goals_a, goals_b)
            self.match.renamed += renamed
            stack += [
                (self._add_pair(path, pair), pair[0].children, pair[1].children)
                for pair in (*pairs, *renamed)
            ]
            for unmatched, goals in zip(self.match.unmatched, (goals_a, goals_b), strict=True):
                unmatched.extend(goals)
                self.match.labels.update({goal: self._label(path, goal) for goal in goals})

    def pair_moved(self) -> None:
        """Pair the remaining goals with similar goals of other parents."""
        by_kind: dict[object, list[Goal]] = defaultdict(list)
        unmatched_a, unmatched_b = self.match.unmatched
        for candidate in unmatched_b:
            by_kind[candidate.kind].append(candidate)
        for goal_a in list(unmatched_a):
            goal_b = max(by_kind[goal_a.kind][:MAX_CANDIDATES], key=goal_a.similarity, default=None)
            if goal_b is None or goal_a.similarity(goal_b) < MIN_SIMILARITY:
                continue
            by_kind[goal_a.kind].remove(goal_b)
            unmatched_a.remove(goal_a)
            unmatched_b.remove(goal_b)
            self.match.moved.append((goal_a, goal_b))
            self.match.pairs.append((goal_a, goal_b))
            label = self.match.labels[goal_b] = self.match.labels[goal_a]
            self.pair_siblings(label, goal_a.children, goal_b.children)

    def _add_pair(self, path: str, pair: Pair) -> str:
        """Add a pair; return its label."""
        self.match.pairs.append(pair)
        label = self._label(path, pair[0])
        self.match.labels.update(dict.fromkeys(pair, label))
        return label

    def _label(self, path: str, goal: Goal) -> str:
        """Return a unique label for a goal: the id without its number, or the class."""
        name = anonymous(goal.key[1]).replace("gen#", "").strip("-") or goal.goal_class
        label = f"{path}/{name}"
        self._counts[label] += 1
        return label if self._counts[label] == 1 else f"{label}[{self._counts[label]}]"


def _take_similar(goals_a: list[Goal], goals_b: list[Goal]) -> list[Pair]:
    """Remove pairs of the same kind from siblings, the most similar first, and return them."""
    kinds: dict[object, tuple[list[Goal], list[Goal]]] = defaultdict(lambda: ([], []))
    for run, goals in enumerate((goals_a, goals_b)):
        for goal in goals:
            kinds[goal.kind][run].append(goal)
    pairs: list[Pair] = []
    for group in kinds.values():
        is_comparable = 1 < len(group[0]) * len(group[1]) <= MAX_COMPARED
        pairs += _most_similar(*group, 0.0) if is_comparable else zip(*group, strict=False)
    drop_pairs(pairs, goals_a, goals_b)
    return pairs


def _take_renamed(goals_a: list[Goal], goals_b: list[Goal]) -> list[Pair]:
    """Remove pairs of different kinds but similar behaviour from siblings, and return them."""
    if len(goals_a) * len(goals_b) > MAX_COMPARED:
        return []
    pairs = [
        pair for pair in _most_similar(goals_a, goals_b, MIN_SIMILARITY) if pair[0].key[0] == pair[1].key[0]
    ]
    drop_pairs(pairs, goals_a, goals_b)
    return pairs


def _most_similar(goals_a: Sequence[Goal], goals_b: Sequence[Goal], minimum: float) -> list[Pair]:
    """Return pairs of goals by decreasing similarity; equally similar ones by closeness of their indices."""
    ranking = sorted(
        (-goal_a.similarity(goal_b), abs(i - j), i, j)
        for i, goal_a in enumerate(goals_a)
        for j, goal_b in enumerate(goals_b)
    )
    paired: tuple[set[int], set[int]] = (set(), set())
    pairs: list[Pair] = []
    for negated, _, i, j in ranking:
        if -negated >= minimum and i not in paired[0] and j not in paired[1]:
            paired[0].add(i)
            paired[1].add(j)
            pairs.append((goals_a[i], goals_b[j]))
    return sorted(pairs, key=lambda pair: pair[0].start)
